// Forward kinematics: world positions and rotations of a frame's joints (models/motion/README.md,
// "Forward kinematics").
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

struct WorldPose {
  std::vector<Eigen::Quaterniond> rotation;  // [joint], joint's frame to the world
  std::vector<Eigen::Vector3d> position_m;   // [joint]
};

// G = G_parent L and p = p_parent + G_parent offset, with the skeleton's root joint at the frame's
// root position. A joint that was not measured counts as not rotated. Cold: allocates.
[[nodiscard]] WorldPose world_pose(const Skeleton& skeleton, const Frame& frame);

}  // namespace posed::motion
