// A walk goes out of the emulator of each mocap system and in through its driver: every bone that
// the format carries comes back as it was.
#include <catch2/catch.hpp>

#include <array>
#include <bitset>
#include <memory>
#include <utility>
#include <vector>

#include "daemon/emulate/clip_motion.hpp"
#include "drivers/driver.hpp"
#include "models/motion/interpolate.hpp"
#include "models/motion/kinematics.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::emulate {
namespace {

constexpr double kWithin_rad = 0.1 * kDegree;
constexpr std::int64_t kLength_ns = 2 * kNanosPerSecond;

// What a host sees of an emulated system.
struct Host {
  explicit Host(const drivers::Driver& of)
      : driver(of), decoder(of.make_decoder(of.expect({}).value()).value()) {}

  void hear(std::uint8_t socket, const std::vector<std::byte>& bytes, std::int64_t now_ns) {
    const int before = sink.descriptions;
    decoder->feed_socket(socket, bytes, now_ns, sink);
    if (sink.descriptions == before) return;
    auto layout = driver.make_layout(sink.described);
    if (!layout) FAIL(layout.error().text());
    layouts.push_back(std::move(*layout));
    decoder->use(*layouts.back());
  }

  const drivers::Driver& driver;
  std::unique_ptr<drivers::Decoder> decoder;
  std::vector<std::unique_ptr<const drivers::SourceLayout>> layouts;
  test::CollectSink sink;
};

// Rotation of each bone in the world relative to its T-pose.
struct Turns {
  Turns(const Skeleton& skeleton, const Frame& frame) {
    const motion::WorldPose pose = motion::world_pose(skeleton, frame);
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
      const Joint& joint = skeleton.joints[j];
      if (!joint.bone) continue;
      const auto bone = static_cast<std::size_t>(*joint.bone);
      turn[bone] = pose.rotation[j] * joint.T_world_joint.conjugate();
      there[bone] = frame.valid[j];
    }
  }
  std::array<Eigen::Quaterniond, kBones> turn;
  std::bitset<kBones> there;
};

// The largest difference of a bone that both have [rad].
double difference_rad(const Turns& a, const Turns& b) {
  double worst_rad = 0.0;
  for (std::size_t bone = 0; bone < kBones; ++bone) {
    if (!a.there[bone] || !b.there[bone]) continue;
    worst_rad = std::max(worst_rad, angle_between_rad(a.turn[bone], b.turn[bone]));
  }
  return worst_rad;
}

}  // namespace

TEST_CASE("a walk passes through every mocap system as it was") {
  const test::TempFolder dir;
  const clip::Clip walk =
      motion::make_walker({.seconds = 3.0, .rate_hz = 120.0, .noise_deg = 0.0}).value();
  REQUIRE(clip::write_bvh(walk, dir.path() / "walk.bvh"));
  const clip::Clip read = clip::read_clip(dir.path() / "walk.bvh").value();
  for (const drivers::Driver& driver : drivers::registry()) {
    if (driver.make_layout == nullptr || driver.emulate == nullptr) continue;
    INFO(driver.name);
    const auto emulator = driver.emulate({}).value();
    const Motion motion = clip_motion(dir.path() / "walk.bvh", *emulator).value();
    Host host(driver);
    std::size_t compared = 0;
    // A driver may learn only from the next frame that one was complete.
    std::int64_t posed_ns = 0, posed_before_ns = 0;
    const auto turns_at = [&](std::int64_t at_ns) {
      const double at = seconds(at_ns) * read.frame_rate_hz;
      const int index = static_cast<int>(at);
      Frame pose = read.frame(index);
      motion::interpolate(*read.skeleton, read.frame(index), read.frame(index + 1), at - index,
                          pose);
      return Turns(*read.skeleton, pose);
    };
    while (posed_ns < kLength_ns) {
      const std::int64_t due_ns = emulator->next_due_ns();
      REQUIRE(due_ns != kNoTime_ns);
      if (due_ns > posed_ns) posed_before_ns = std::exchange(posed_ns, due_ns);
      motion(seconds(due_ns), *emulator);
      std::vector<std::byte> bytes;
      const std::uint8_t socket = emulator->next_socket();
      emulator->emit(due_ns, bytes);
      host.hear(socket, bytes, due_ns);
      for (std::size_t i = 0; i < host.sink.frames.size(); ++i) {
        const drivers::Body& body = host.layouts.back()->bodies[host.sink.bodies[i]];
        const Turns got(*body.skeleton, host.sink.frames[i]);
        const double off_rad = std::min(difference_rad(got, turns_at(posed_ns)),
                                        difference_rad(got, turns_at(posed_before_ns)));
        if (got.there.count() < 5) continue;  // a prop
        CHECK(off_rad < kWithin_rad);
        ++compared;
      }
      for (const Outcome wrong : {Outcome::kShort, Outcome::kBadChecksum, Outcome::kOutOfRange,
                                  Outcome::kLate, Outcome::kDuplicate}) {
        CHECK(host.sink.count(wrong) == 0);  // foreign is a frame before its layout
      }
      host.sink.clear();
    }
    CHECK(compared > 100);
  }
}

}  // namespace posed::emulate
