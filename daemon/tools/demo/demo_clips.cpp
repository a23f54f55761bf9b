#include "daemon/tools/demo/demo_clips.hpp"

#include <spdlog/fmt/fmt.h>

#include "models/gesture/synthetic_signer.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/label_file.hpp"

namespace posed::tools {
namespace {

constexpr std::uint32_t kPeople = 6;  // of each family
constexpr std::uint32_t kNewPerson = 21;
constexpr double kNewWalkSeconds = 20.0;
constexpr const char* kGlove = "glove_train.csv";
constexpr const char* kGloveLabels = "glove_train.lab";

Result<std::filesystem::path> write_walker(const std::filesystem::path& path,
                                           const motion::WalkerOptions& options) {
  const auto walk = TRY(motion::make_walker(options));
  TRY(clip::write_bvh(walk, path));
  return path;
}

// Writes the glove recording for training, with labels, and a new person who performs g, c, p.
Result<> write_hands(const std::filesystem::path& folder, DemoClips& clips) {
  clips.glove = folder / kGlove;
  clips.labels = folder / kGloveLabels;
  const auto learnt = TRY(gesture::make_performance({}));
  TRY(clip::write_hand_csv(learnt.clip, clips.glove));
  TRY(clip::write_labels(learnt.labels, clips.labels));
  const auto signer = TRY(gesture::make_performance(
      {.person = kNewPerson, .script = {"g", "c", "p", "g", "c", "p", "c", "g", "p", "c"}}));
  return clip::write_hand_csv(signer.clip, folder / kDemoSigner);
}

}  // namespace

std::vector<std::string> demo_file_names() {
  std::vector<std::string> names{kDemoModel,  kDemoWalker, kDemoHand,
                                 kDemoSigner, kGlove,      kGloveLabels};
  for (std::uint32_t person = 1; person <= kPeople; ++person) {
    names.push_back(fmt::format("walk_{}.bvh", person));
    names.push_back(fmt::format("sneak_{}.bvh", person));
  }
  return names;
}

Result<DemoClips> make_demo_clips(const std::filesystem::path& folder) {
  std::error_code made;
  std::filesystem::create_directories(folder, made);
  if (made) return fail("cannot make the folder: " + made.message(), folder.string());
  DemoClips clips;
  for (std::uint32_t person = 1; person <= kPeople; ++person) {
    clips.from.push_back(
        TRY(write_walker(folder / fmt::format("walk_{}.bvh", person),
                         {.family = motion::WalkerFamily::kWalk, .person = person})));
    clips.to.push_back(
        TRY(write_walker(folder / fmt::format("sneak_{}.bvh", person),
                         {.family = motion::WalkerFamily::kSneak, .person = person})));
  }
  TRY(write_walker(folder / kDemoWalker, {.family = motion::WalkerFamily::kWalk,
                                          .person = kNewPerson,
                                          .seconds = kNewWalkSeconds,
                                          .round = true}));
  TRY(write_hands(folder, clips));
  return clips;
}

}  // namespace posed::tools
