// The skeleton of a body with the hands of gloves: finger joints that the body has keep their names
// and places, the others are added below the hand, with the glove's lengths and VRM's names. Cold.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::merge {

// The canonical bones of one hand: the wrist's, and the one above a finger joint (0 to 14).
[[nodiscard]] constexpr Bone hand_bone_of(Side side) noexcept {
  return side == Side::kLeft ? Bone::kLeftHand : Bone::kRightHand;
}
[[nodiscard]] constexpr Bone bone_above(Side side, int finger_joint) noexcept {
  return finger_joint % kFingerJoints == 0 ? hand_bone_of(side) : hand_bone(side, finger_joint - 1);
}

[[nodiscard]] constexpr bool is_rotation(const Channel& channel) noexcept {
  return !channel.translation;
}

struct MergedSkeleton {
  std::shared_ptr<const Skeleton> skeleton;
  std::vector<int> joint_of;  // [joint of the body] its joint in `skeleton`
  std::vector<int> angle_of;  // [rotation channel of the body] its place among those of `skeleton`
};

// `gloves`: left and right, null for none; each has all fifteen finger joints of its side. Fails if
// the body lacks the hand, or if there are more joints than posed carries.
Result<MergedSkeleton> merge_skeletons(const Skeleton& body,
                                       const std::array<const Skeleton*, 2>& gloves);

}  // namespace posed::merge
