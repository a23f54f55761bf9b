// The bones of a hand as capsules that move with its 45 angles: forward kinematics and the axis
// about which each angle turns (models/hand/README.md, "Capsules and forward kinematics"). Right
// hand, in the wrist's frame, metres; a left hand is the mirror image, so distances are the same.
#pragma once

#include <array>

#include <Eigen/Geometry>

#include "proto/frame/hand.hpp"
#include "proto/frame/hand_shape.hpp"
#include "proto/frame/rt_safe.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::hand {

struct FingerGeometry {
  Eigen::Vector3d base_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d root = Eigen::Matrix3d::Identity();   // in which the first joint's channels turn
  Eigen::Matrix3d bones = Eigen::Matrix3d::Identity();  // from `root` to the others' frame
  Eigen::Vector3d along = Eigen::Vector3d::UnitZ();  // direction of the bones in the others' frame
  std::array<double, kFingerJoints> length_m{};
  std::array<double, kFingerJoints> radius_m{};
};

struct HandGeometry {
  std::array<FingerGeometry, kFingers> fingers;
  HandAngles low_rad{};
  HandAngles high_rad{};
};

// The built-in shape that a skeleton of hand_skeleton() names, "hand45 right adult"; else the
// default one. Cold.
[[nodiscard]] const HandShape& shape_of(const Skeleton& skeleton);

// Cold.
[[nodiscard]] HandGeometry hand_geometry(const HandShape& shape);

// A hand in one pose. Bone b = 3 finger + joint goes from its joint to the next joint or the tip.
struct HandPose {
  std::array<Eigen::Vector3d, kHandJoints> from_m;
  std::array<Eigen::Vector3d, kHandJoints> to_m;
  std::array<Eigen::Vector3d, kHandChannels>
      axis;  // unit vector about which each angle turns in this pose
};

// Applies R = Rz(twist) Rx(flexion) Ry(spread) at each joint, from base to tip.
RT_SAFE void place(const HandGeometry& geometry, const HandAngles& angles, HandPose& pose) noexcept;
// Places one finger as place_hand() does; the others stay as they are.
RT_SAFE void place_finger(const HandGeometry& geometry, int finger, const HandAngles& angles,
                          HandPose& pose) noexcept;

}  // namespace posed::hand
