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
  const auto walk = motion::make_walker(options);
  if (!walk) return std::unexpected(walk.error());
  if (auto written = clip::write_bvh(*walk, path); !written) {
    return std::unexpected(written.error());
  }
  return path;
}

// Writes the glove recording for training, with labels, and a new person who performs g, c, p.
Result<> write_hands(const std::filesystem::path& folder, DemoClips& clips) {
  clips.glove = folder / kGlove;
  clips.labels = folder / kGloveLabels;
  const auto learnt = gesture::make_performance({});
  if (!learnt) return std::unexpected(learnt.error());
  if (auto done = clip::write_hand_csv(learnt->clip, clips.glove); !done) return done;
  if (auto done = clip::write_labels(learnt->labels, clips.labels); !done) return done;
  const auto signer = gesture::make_performance(
      {.person = kNewPerson, .script = {"g", "c", "p", "g", "c", "p", "c", "g", "p", "c"}});
  if (!signer) return std::unexpected(signer.error());
  return clip::write_hand_csv(signer->clip, folder / kDemoSigner);
}

}  // namespace

std::vector<std::string> demo_file_names() {
  std::vector<std::string> names{kDemoModel,  kDemoWalker, kDemoHand,
                                 kDemoSigner, kGlove,      kGloveLabels};
  for (std::uint32_t person = 1; person <= kPeople; ++person) {
    names.push_back(fmt::format("march_{}.bvh", person));
    names.push_back(fmt::format("sway_{}.bvh", person));
  }
  return names;
}

Result<DemoClips> make_demo_clips(const std::filesystem::path& folder) {
  std::error_code made;
  std::filesystem::create_directories(folder, made);
  if (made) return fail("cannot make the folder: " + made.message(), folder.string());
  DemoClips clips;
  for (std::uint32_t person = 1; person <= kPeople; ++person) {
    // The two families have different people, as with real actors.
    auto march = write_walker(folder / fmt::format("march_{}.bvh", person),
                              {.family = motion::WalkerFamily::kMarch, .person = person});
    if (!march) return std::unexpected(march.error());
    auto sway = write_walker(folder / fmt::format("sway_{}.bvh", person),
                             {.family = motion::WalkerFamily::kSway, .person = kPeople + person});
    if (!sway) return std::unexpected(sway.error());
    clips.from.push_back(*march);
    clips.to.push_back(*sway);
  }
  auto walker = write_walker(
      folder / kDemoWalker,
      {.family = motion::WalkerFamily::kMarch, .person = kNewPerson, .seconds = kNewWalkSeconds});
  if (!walker) return std::unexpected(walker.error());
  if (auto done = write_hands(folder, clips); !done) return std::unexpected(done.error());
  return clips;
}

}  // namespace posed::tools
