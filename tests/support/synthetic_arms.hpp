// The gesture model of a synthetic body that raises one arm at a time, for tests without
// recordings.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/arm_gestures.hpp"
#include "tests/support/arm_raiser.hpp"

namespace posed::test {

inline std::vector<ArmTake> synthetic_takes() {
  std::vector<ArmTake> takes;
  for (std::uint32_t take = 1; take <= 8; ++take) {
    takes.push_back({raise_take({.left = true, .take = take}), "raise-left"});
    takes.push_back({raise_take({.right = true, .take = 20 + take}), "raise-right"});
  }
  return takes;
}

inline gesture::GestureModel synthetic_arms() {
  const auto takes = synthetic_takes();
  return train_arms(takes, arm_vocabulary(*takes.front().clip.skeleton));
}

// Rotation of an upper arm about Z, as the figure has it [deg]; hanging: -70 left, 70 right.
inline double raised_deg(const Skeleton& skeleton, const Frame& frame, Bone bone) {
  const auto joint = static_cast<std::size_t>(skeleton.joint_of(bone));
  return rotation_log(to_eigen_double(frame.rotation_xyzw[joint])).z() / kDegree;
}

}  // namespace posed::test
