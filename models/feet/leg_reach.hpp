// Two-bone inverse kinematics: bends a leg so that its ankle is elsewhere; the knee keeps its
// direction (models/feet/README.md, "Reach"). RT-safe.
#pragma once

#include <Eigen/Geometry>

#include "models/feet/legs.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::feet {

struct Reach {
  Eigen::Vector3d ankle_m;       // as near to the wanted place as the leg can reach
  Eigen::Quaterniond leg_turn;   // of thigh and shin together, in the world
  Eigen::Quaterniond knee_turn;  // of the shin alone, in the world, before leg_turn
};

// Bends `leg` of `pose` so that its ankle gets to `ankle_m`. Places are from the root joint, in
// world axes.
RT_SAFE [[nodiscard]] Reach reach(const Skeleton& skeleton, const Leg& leg, const LegPose& pose,
                                  const Eigen::Vector3d& ankle_m) noexcept;

// Writes the bent leg into `frame`, whose pose `pose` was, with the foot turned to `foot` in the
// world.
RT_SAFE void write_leg(const Skeleton& skeleton, const Leg& leg, const LegPose& pose,
                       const Reach& bent, const Eigen::Quaterniond& foot, Frame& frame) noexcept;

}  // namespace posed::feet
