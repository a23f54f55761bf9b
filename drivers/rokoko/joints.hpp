// The joints and the face values that Rokoko Studio streams: names, parents, bones, and how each
// joint is turned while the actor stands in Studio's T-pose.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <optional>
#include <string_view>

#include "proto/frame/frame.hpp"
#include "proto/frame/humanoid.hpp"

namespace posed::drivers::rokoko {

inline constexpr std::size_t kStudioJoints = 63;
inline constexpr std::size_t kFaceValues = 52;
using JointSet = std::bitset<kStudioJoints>;

struct StudioJoint {
  std::string_view name;
  int parent = -1;  // an earlier one: the joints are in depth-first order
  std::optional<Bone> bone;
  // The global rotation in T-pose, as the vendor's plugin for Blender lists it (animation_lists.py
  // of rokoko-studio-live-blender): w, x, y, z in Unity's axes. Five digits, not of unit length.
  std::array<float, 4> reference_wxyz{};
};

RT_SAFE [[nodiscard]] const StudioJoint& studio_joint(std::size_t joint) noexcept;
RT_SAFE [[nodiscard]] std::string_view face_value_name(std::size_t value) noexcept;
RT_SAFE [[nodiscard]] std::size_t joint_named(std::string_view name) noexcept;
RT_SAFE [[nodiscard]] std::size_t face_value_named(std::string_view name) noexcept;

inline constexpr std::size_t kLeftHandJoint = 8;  // its fingers follow
inline constexpr std::size_t kRightHandJoint = 32;
inline constexpr std::size_t kFingerJointsOfHand = 20;

// The fingers of the hand at this joint.
RT_SAFE [[nodiscard]] JointSet fingers_of(std::size_t hand) noexcept;

// Returns the nearest ancestor of a joint in a skeleton with these joints only; -1: there is none.
RT_SAFE [[nodiscard]] int parent_among(const JointSet& joints, std::size_t joint) noexcept;

// Those of the joints that one skeleton can hold: the first one, and what hangs below it.
RT_SAFE [[nodiscard]] JointSet connected(const JointSet& joints) noexcept;

// Unity's axes are left-handed, Y up, facing +Z with the left hand at -X: posed's are their mirror
// image in X.
RT_SAFE [[nodiscard]] inline Vec3f mirrored(const Vec3f& position) noexcept {
  return {-position[0], position[1], position[2]};
}
[[nodiscard]] inline Quatf mirrored(const Quatf& rotation_xyzw) noexcept {
  return {rotation_xyzw[0], -rotation_xyzw[1], -rotation_xyzw[2], rotation_xyzw[3]};
}

// The joint's rotation in T-pose in posed's axes, of unit length. Cold.
[[nodiscard]] Quatf t_pose_rotation(std::size_t joint) noexcept;

}  // namespace posed::drivers::rokoko
