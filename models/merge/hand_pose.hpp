// HandPose: the fifteen finger joints and the wrist of one hand as canonical rotations
// (models/motion/README.md, "Canonical humanoid"), so that a glove's pose fits any body's skeleton.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/time.hpp"

namespace posed::merge {

inline constexpr std::size_t kWrist = kHandJoints;  // its place, behind the finger joints
inline constexpr std::size_t kHandTurns = kHandJoints + 1;

struct HandPose {
  // [finger joint, then wrist] relative to the bone above; identity in T-pose.
  std::array<Eigen::Quaterniond, kHandTurns> turn;
  std::bitset<kHandTurns> valid;  // known; the others have no meaning

  HandPose() noexcept { turn.fill(Eigen::Quaterniond::Identity()); }
};

// A pose that a glove measured.
struct TimedPose {
  std::int64_t time_ns = kNoTime_ns;  // on the host's clock
  Quality quality = Quality::kMeasured;
  HandPose pose;
};

// `base`, with each joint that both `a` and `b` know on the shortest arc from `a` (part 0) to `b`
// (part 1). RT-safe.
[[nodiscard]] inline HandPose blend(const HandPose& base, const HandPose& a, const HandPose& b,
                                    double part) noexcept {
  HandPose pose = base;
  for (std::size_t i = 0; i < kHandTurns; ++i) {
    if (a.valid[i] && b.valid[i]) pose.turn[i] = a.turn[i].slerp(part, b.turn[i]);
  }
  return pose;
}

}  // namespace posed::merge
