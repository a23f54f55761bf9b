#include "daemon/tools/demo/demo_clips.hpp"

#include <spdlog/fmt/fmt.h>

#include "models/gesture/camera_takes.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/label_file.hpp"

namespace posed::tools {
namespace {

constexpr std::uint32_t kPeople = 6;  // of each family
constexpr std::uint32_t kNewPerson = 21;
constexpr double kNewWalkSeconds = 24.0;
constexpr const char* kGlove = "glove_train";
constexpr std::size_t kCameraTakes = 32;

Result<std::filesystem::path> write_walker(const std::filesystem::path& path,
                                           const motion::WalkerOptions& options) {
  const auto walk = TRY(motion::make_walker(options));
  TRY(clip::write_bvh(walk, path));
  return path;
}

std::string camera_take(std::size_t take) { return fmt::format("camera_train_{}", take + 1); }

Result<LabelledClip> write_performance(const gesture::Performance& performance,
                                       const std::filesystem::path& folder,
                                       const std::string& name) {
  LabelledClip files{.clip = folder / (name + ".csv"), .labels = folder / (name + ".lab")};
  TRY(clip::write_hand_csv(performance.clip, files.clip));
  TRY(clip::write_labels(performance.labels, files.labels));
  return files;
}

// Writes the recordings for training, with labels, and a new person who performs g, c, p.
Result<> write_hands(const std::filesystem::path& folder, DemoClips& clips) {
  clips.glove = TRY(write_performance(TRY(gesture::make_performance({})), folder, kGlove));
  for (const gesture::Performance& take : gesture::camera_takes()) {
    clips.camera.push_back(TRY(write_performance(take, folder, camera_take(clips.camera.size()))));
  }
  const auto signer = TRY(gesture::make_performance(
      {.person = kNewPerson, .script = {"g", "c", "p", "g", "c", "p", "c", "g", "p", "c"}}));
  return clip::write_hand_csv(signer.clip, folder / kDemoSigner);
}

}  // namespace

std::vector<std::string> demo_file_names() {
  std::vector<std::string> names{kDemoModel, kDemoWalker, kDemoHand, kDemoSigner, kDemoCamera};
  const auto add_hand = [&names](const std::string& name) {
    names.push_back(name + ".csv");
    names.push_back(name + ".lab");
  };
  add_hand(kGlove);
  for (std::size_t take = 0; take < kCameraTakes; ++take) add_hand(camera_take(take));
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
