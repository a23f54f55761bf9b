// Skeleton: the joints of one source, how its channels become rotations, and which of its joints
// are which bones of the canonical humanoid (VRM / Unity names).
//
// Shapes: joints in depth-first order, so a parent stands before its children. Offsets in metres,
// in the parent's frame, posed's axes. Cold: built when a stream opens, const and shared
// afterwards.
#pragma once

#include <array>
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
  bool translation = false;  // metres in the parent's frame; a rotation [rad] otherwise
  float min = -std::numeric_limits<float>::infinity();
  float max = std::numeric_limits<float>::infinity();
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
  // (models/motion/README.md, "Canonical humanoid"); the canonical local rotation is T_parent L
  // T_joint^-1.
  Eigen::Quaterniond T_world_joint = Eigen::Quaterniond::Identity();
};

struct Skeleton {
  std::string name;           // profile or file it came from, for people
  std::vector<Joint> joints;  // at most kMaxJoints
  // Joint by joint; within a joint the first listed rotation is outermost. A BVH's own order; an
  // Acclaim joint's dof reversed, because there the last is outermost. Position channels replace
  // the joint's offset.
  std::vector<Channel> channels;
  int root_joint = 0;    // the joint whose world position a Frame carries (the hips, as a rule)
  std::uint32_t id = 0;  // CRC-32 of the content; set by finish()

  [[nodiscard]] int joint_index(std::string_view joint_name) const;  // -1 when there is none
  [[nodiscard]] int joint_of(Bone bone) const;                       // -1 when there is none

  // Checks the counts and the order, names the canonical bones and their T frames where `bone` is
  // not set yet (by name and OFFSET direction), and computes id. Errors name the joint.
  [[nodiscard]] Result<> finish();
};

// Channel values of one frame [rad, m], in Skeleton::channels order, to the pose: fills rotations,
// root position, validity, angles, counts and skeleton id. RT-safe.
void pose_from_channels(const Skeleton& skeleton, std::span<const double> values,
                        Frame& frame) noexcept;

// L of one joint from the channel values of the whole frame, in double. RT-safe.
[[nodiscard]] Eigen::Quaterniond local_rotation(const Skeleton& skeleton, int joint,
                                                std::span<const double> values) noexcept;

// The three Euler angles [rad] of `rotation` in the joint's own channel order (first listed
// outermost), the turn nearest to `near_rad`. For fewer than three axes the closest the joint can
// do. RT-safe.
[[nodiscard]] std::array<double, 3> channels_from_rotation(const Skeleton& skeleton, int joint,
                                                           const Eigen::Quaterniond& rotation,
                                                           const std::array<double, 3>& near_rad);

// Turns one joint of the frame anew: its rotation and, where the frame carries angles, the nearest
// values of its channels. RT-safe.
void set_rotation(const Skeleton& skeleton, int joint, const Eigen::Quaterniond& rotation,
                  Frame& frame) noexcept;

}  // namespace posed
