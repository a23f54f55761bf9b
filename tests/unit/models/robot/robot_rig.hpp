// A robot stage with our own URDF, and what it sends.
#pragma once

#include <catch2/catch.hpp>

#include <memory>
#include <vector>

#include "models/robot/robot_stage.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {

class FrameList final : public StageOut {
 public:
  void frame(const StageFrame& frame) noexcept override { frames.push_back(frame.frame); }
  std::vector<Frame> frames;
};

inline std::string mitten() { return (source_dir() / "config/robots/mitten.urdf").string(); }

class RobotRig {
 public:
  explicit RobotRig(const Parameters& more = {}, Side side = Side::kRight,
                    const std::string& urdf = mitten(), double rate_hz = 100.0) {
    const StageType& type = robot::robot_type();
    Parameters given = more;
    given["urdf"] = urdf;
    Parameters parameters = complete_parameters(type.parameters, given).value();
    REQUIRE(type.read_files(parameters));
    hand = std::make_shared<const Skeleton>(hand_skeleton(side));
    context = {.skeleton = hand, .rate_hz = rate_hz, .parameters = parameters};
    skeleton = type.leaves(context).value();
    stage = type.make(context, nullptr).value();
  }

  void send(const HandAngles& angles, std::int64_t arrival_ns,
            Quality quality = Quality::kMeasured) {
    Frame frame;
    set_hand_angles(*hand, angles, frame);
    frame.quality = quality;
    frame.header.arrival_ns = arrival_ns;
    stage->received(arrival_ns);
    stage->process({.frame = frame, .input = &frame}, out);
  }
  void tick_until(std::int64_t now_ns) {
    for (int i = 0; i < 10000; ++i) {
      const std::int64_t due_ns = stage->next_due_ns();
      if (due_ns == kNoTime_ns || due_ns > now_ns) return;
      stage->tick(due_ns, out);
    }
    FAIL("the stage asks for ticks for ever");
  }
  void engage() { REQUIRE(stage->command(robot::kEngage, {})); }
  void release() { REQUIRE(stage->command(robot::kRelease, {})); }
  [[nodiscard]] const Frame& last() const { return out.frames.back(); }

  std::shared_ptr<const Skeleton> hand, skeleton;
  StageContext context;
  std::unique_ptr<Stage> stage;
  FrameList out;
};

// A hand that closes by `share` of a fist.
inline HandAngles fist(double share) {
  HandAngles angles{};
  for (int f = 1; f < kFingers; ++f) {
    for (int j = 0; j < kFingerJoints; ++j) {
      angles[static_cast<std::size_t>(kFingerChannels * f + 3 * j)] = 1.2 * share;
    }
  }
  return angles;
}

}  // namespace posed::test
