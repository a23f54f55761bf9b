// The skeleton of a single hand: the wrist as root and fifteen finger joints, named as their
// canonical bones. Zero angles are a flat hand, palm down, fingers along +Z.
//
// Joints: the wrist (no channels, at the origin), then finger by finger, thumb to little, from the
// palm outwards. Channels of a joint: z, x, y, because R = Rz(twist) Rx(flexion) Ry(spread). A
// Frame's angle_rad holds hand45 angles with hand45's signs. The joint's channel_frame does the
// mirroring: a left hand is the mirror image of the right, and ring and little turn (spread and
// twist) as a mirror image of the index does, so that spread is positive away from the middle
// finger.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_shape.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed {

inline constexpr int kHandSkeletonJoints = 1 + kHandJoints;

// Index of a finger's joint (0 to 2, from the palm outwards) in the skeleton.
RT_SAFE [[nodiscard]] constexpr int hand_joint(int finger, int joint) noexcept {
  return 1 + finger * kFingerJoints + joint;
}

// The canonical bone of a finger joint, counted from 0 over the fingers.
RT_SAFE [[nodiscard]] constexpr Bone hand_bone(Side side, int joint) noexcept {
  const Bone first = side == Side::kLeft ? Bone::kLeftThumbMetacarpal : Bone::kRightThumbMetacarpal;
  return static_cast<Bone>(static_cast<int>(first) + joint);
}

// [channel of the skeleton] index in HandAngles, and the inverse.
inline constexpr std::array<std::size_t, kHandChannels> kAngleOfChannel = [] {
  constexpr std::array<std::size_t, 3> kOrder{2, 0, 1};  // z, x, y
  std::array<std::size_t, kHandChannels> table{};
  for (std::size_t c = 0; c < table.size(); ++c) table[c] = c / 3 * 3 + kOrder[c % 3];
  return table;
}();
inline constexpr std::array<std::size_t, kHandChannels> kChannelOfAngle = [] {
  std::array<std::size_t, kHandChannels> table{};
  for (std::size_t c = 0; c < table.size(); ++c) table[kAngleOfChannel[c]] = c;
  return table;
}();

// Named "hand45 right adult" and so on; finished, with bones, T frames and the shape's limits.
// Cold.
[[nodiscard]] Skeleton hand_skeleton(Side side, const HandShape& shape = default_hand_shape());

// The frame in which the channels of a finger's joint (0 to 2) turn, and the joints' offsets;
// mirrored for a left hand.
[[nodiscard]] Eigen::Quaterniond channel_frame(Side side, const HandShape& shape, int finger,
                                               int joint);
[[nodiscard]] Eigen::Vector3d mirrored(Side side, const Eigen::Vector3d& right_m) noexcept;

// The side of a skeleton made by hand_skeleton() (of any shape); empty for other skeletons.
[[nodiscard]] std::optional<Side> hand_side(const Skeleton& skeleton);

// The angles in a frame of a hand skeleton; not finite where the source had no value.
RT_SAFE [[nodiscard]] HandAngles hand_angles(const Frame& frame) noexcept;

// Poses the frame of a hand skeleton: sets rotations, validity and angle_rad. A joint with an angle
// that is not finite is not valid. Does not change header, label, quality or stamps.
RT_SAFE void set_hand_angles(const Skeleton& skeleton, const HandAngles& angles,
                             Frame& frame) noexcept;

}  // namespace posed
