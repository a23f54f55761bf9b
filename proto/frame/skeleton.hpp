// Skeleton: the joints of one source, how its channels become rotations, and which joints are which
// bones of the canonical humanoid (VRM / Unity names).
//
// Shapes: joints are in depth-first order, so a parent precedes its children. Offsets are in
// metres, in the parent's frame, in posed's axes. Lifetime: built when a stream opens (cold), then
// const and shared.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/rotation.hpp"

namespace posed {

struct Channel {
  std::uint16_t joint = 0;
  Axis axis = Axis::kX;
  bool translation = false;  // metres in the parent's frame; otherwise a rotation [rad]
  float min = -std::numeric_limits<float>::infinity();
  float max = std::numeric_limits<float>::infinity();
  bool follows = false;  // mechanically tied to another joint, so that nobody may command it
};

struct Joint {
  std::string name;
  int parent = -1;
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> end_site_m;  // a leaf's tip, in the joint's frame
  // The frame in which the channels turn: L = C * M * C^-1 (Acclaim); identity for BVH.
  Eigen::Quaterniond channel_frame = Eigen::Quaterniond::Identity();
  std::optional<Bone> bone;  // which canonical bone this joint is
  // T: global rotation of this joint when the figure stands in the canonical T-pose
  // (models/motion/README.md, "Canonical humanoid"). The canonical local rotation is T_parent L
  // T_joint^-1.
  Eigen::Quaterniond T_world_joint = Eigen::Quaterniond::Identity();
};

// A shape that a robot's joint carries, in the joint's frame.
struct JointCapsule {
  std::uint16_t joint = 0;
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
};

struct Skeleton {
  std::string name;           // profile or file of origin, shown to users
  std::vector<Joint> joints;  // at most kMaxJoints
  // Grouped by joint; within a joint the first listed rotation is outermost. A BVH keeps its order;
  // the dof of an Acclaim joint are reversed, because there the last is outermost. Position
  // channels replace the joint's offset.
  std::vector<Channel> channels;
  std::vector<JointCapsule> capsules{};  // of a robot, which looks like them
  int root_joint = 0;    // the joint whose world position a Frame carries (usually the hips)
  std::uint32_t id = 0;  // CRC-32 of the content; set by finish()

  [[nodiscard]] int joint_index(std::string_view joint_name) const;  // -1 when there is none
  [[nodiscard]] int joint_of(Bone bone) const;                       // -1 when there is none

  // Checks counts and order, recognises bones and their T frames where no joint has a bone yet
  // (proto/rig), and computes id. Errors name the joint.
  Result<> finish();
};

// T of the joint above; identity above the root.
RT_SAFE [[nodiscard]] inline Eigen::Quaterniond T_above(const Skeleton& skeleton,
                                                        std::size_t joint) noexcept {
  const int parent = skeleton.joints[joint].parent;
  if (parent < 0) return Eigen::Quaterniond::Identity();
  return skeleton.joints[static_cast<std::size_t>(parent)].T_world_joint;
}

// The joint's rotation relative to its parent when its canonical local rotation is this one:
// L = T_above^-1 Lc T_joint; in T-pose without one.
RT_SAFE [[nodiscard]] inline Eigen::Quaterniond local_from_canonical(
    const Skeleton& skeleton, std::size_t joint,
    const Eigen::Quaterniond& canonical = Eigen::Quaterniond::Identity()) noexcept {
  return T_above(skeleton, joint).conjugate() * canonical * skeleton.joints[joint].T_world_joint;
}

// Whether it is a rigid body, such as a sword that a performer holds.
[[nodiscard]] inline bool is_prop(const Skeleton& skeleton) noexcept {
  return skeleton.joints.size() == 1 && !skeleton.joints.front().bone;
}

// A part of Skeleton::channels, so the joint's values have the same place among those of a frame.
RT_SAFE [[nodiscard]] inline std::span<const Channel> channels_of(const Skeleton& skeleton,
                                                                  int joint) noexcept {
  const auto range = std::ranges::equal_range(
      skeleton.channels, joint, {}, [](const Channel& c) { return static_cast<int>(c.joint); });
  return {range.begin(), range.end()};
}

// Position of a joint in its parent's frame [m], from the values of its channels: position channels
// replace the joint's offset.
RT_SAFE [[nodiscard]] inline Eigen::Vector3d local_position(const Joint& joint,
                                                            std::span<const Channel> channels,
                                                            const double* values) noexcept {
  Eigen::Vector3d position_m = joint.offset_m;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i].translation) position_m[static_cast<int>(channels[i].axis)] = values[i];
  }
  return position_m;
}

// Computes the pose from the channel values of one frame [rad, m], in the order of
// Skeleton::channels. Sets rotations, root position, validity, angles, counts and skeleton id.
RT_SAFE void pose_from_channels(const Skeleton& skeleton, std::span<const double> values,
                                Frame& frame) noexcept;

// The local rotation L of one joint from the channel values of the whole frame, in double.
RT_SAFE [[nodiscard]] Eigen::Quaterniond local_rotation(const Skeleton& skeleton, int joint,
                                                        std::span<const double> values) noexcept;

// The three Euler angles [rad] of `rotation` in the joint's own channel order (first listed
// outermost), in the solution nearest to `near_rad`. With fewer than three axes, the closest
// rotation that the joint can make.
RT_SAFE [[nodiscard]] std::array<double, 3> channels_from_rotation(
    const Skeleton& skeleton, int joint, const Eigen::Quaterniond& rotation,
    const std::array<double, 3>& near_rad);

// Changes one joint of the frame: its rotation and, if the frame carries angles, the nearest values
// of its channels.
RT_SAFE void set_rotation(const Skeleton& skeleton, int joint, const Eigen::Quaterniond& rotation,
                          Frame& frame) noexcept;

}  // namespace posed
