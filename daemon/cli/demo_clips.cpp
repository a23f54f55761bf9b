#include "daemon/cli/demo_clips.hpp"

#include <spdlog/fmt/fmt.h>

#include "models/motion/synthetic_walker.hpp"

namespace posed::cli {
namespace {

constexpr std::uint32_t kPeople = 6;  // of each family
constexpr std::uint32_t kNewPerson = 21;
constexpr double kNewWalkSeconds = 20.0;

Result<std::filesystem::path> write_walker(const std::filesystem::path& path,
                                           const motion::WalkerOptions& options) {
  const auto walk = motion::make_walker(options);
  if (!walk) return std::unexpected(walk.error());
  if (auto written = clip::write_bvh(*walk, path); !written) {
    return std::unexpected(written.error());
  }
  return path;
}

}  // namespace

Result<DemoClips> make_demo_clips(const std::filesystem::path& folder) {
  std::error_code made;
  std::filesystem::create_directories(folder, made);
  if (made) return fail("cannot make the folder: " + made.message(), folder.string());
  DemoClips clips;
  for (std::uint32_t person = 1; person <= kPeople; ++person) {
    // Different people in the two families, as with real actors.
    auto march = write_walker(folder / fmt::format("march_{}.bvh", person),
                              {.family = motion::WalkerFamily::kMarch, .person = person});
    if (!march) return std::unexpected(march.error());
    auto sway = write_walker(folder / fmt::format("sway_{}.bvh", person),
                             {.family = motion::WalkerFamily::kSway, .person = kPeople + person});
    if (!sway) return std::unexpected(sway.error());
    clips.from.push_back(*march);
    clips.to.push_back(*sway);
  }
  auto stranger = write_walker(
      folder / kDemoWalker,
      {.family = motion::WalkerFamily::kMarch, .person = kNewPerson, .seconds = kNewWalkSeconds});
  if (!stranger) return std::unexpected(stranger.error());
  return clips;
}

}  // namespace posed::cli
