// The stage that lets a hand drive a robot hand given by its URDF (models/robot/README.md). The
// frames that leave it are the robot's: a channel a joint, in rad, with Frame::velocity_rad_s and
// Frame::robot.
#pragma once

#include "models/robot/robot_hand.hpp"
#include "models/stage_type.hpp"

namespace posed::robot {

// The entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& robot_type();

// Indices of its commands.
inline constexpr std::size_t kEngage = 0;
inline constexpr std::size_t kRelease = 1;

}  // namespace posed::robot
