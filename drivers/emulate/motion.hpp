// The motions of the people in emulated mocap systems. Each calls turn(bone, rotation) for every
// bone that it moves: the rotation is relative to the parent, in the axes of the canonical
// humanoid, identity in T-pose. Pure.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::emulate {

// Swings back and forth as often as a walker makes a double step.
[[nodiscard]] inline double swing_rad(double time_s, double most_rad) {
  constexpr double kStep_hz = 0.9;
  return most_rad * std::sin(2.0 * std::numbers::pi * kStep_hz * time_s);
}

// The direction in which walk() walks, about the vertical axis.
[[nodiscard]] inline double heading_rad(double time_s) {
  constexpr double kLap_s = 12.0;
  return 2.0 * std::numbers::pi * time_s / kLap_s;
}

// Arms hang down and swing against the legs; the path is a circle with a radius of one metre, so
// the motion has no end. Returns where the hips are, `hips_m` above the floor.
template <typename Turn>
Vec3f walk(double time_s, float hips_m, const Turn& turn) {
  const double lap = heading_rad(time_s);
  const double swing = swing_rad(time_s, 0.5);
  turn(Bone::kHips, axis_rotation(Axis::kY, lap));
  turn(Bone::kLeftUpperArm, axis_rotation(Axis::kX, swing) * axis_rotation(Axis::kZ, -1.3));
  turn(Bone::kRightUpperArm, axis_rotation(Axis::kX, -swing) * axis_rotation(Axis::kZ, 1.3));
  turn(Bone::kLeftUpperLeg, axis_rotation(Axis::kX, -swing));
  turn(Bone::kLeftLowerLeg, axis_rotation(Axis::kX, std::max(0.0, swing)));
  turn(Bone::kRightUpperLeg, axis_rotation(Axis::kX, swing));
  turn(Bone::kRightLowerLeg, axis_rotation(Axis::kX, std::max(0.0, -swing)));
  return {static_cast<float>(-std::cos(lap)), hips_m, static_cast<float>(std::sin(lap))};
}

// Stands beside the walker's circle and waves with the right hand.
template <typename Turn>
Vec3f wave(double time_s, float hips_m, const Turn& turn, double most_rad = 0.4) {
  turn(Bone::kLeftUpperArm, axis_rotation(Axis::kZ, -1.3));
  turn(Bone::kRightUpperArm, axis_rotation(Axis::kZ, -0.6));
  turn(Bone::kRightLowerArm, axis_rotation(Axis::kZ, -0.9 + swing_rad(time_s, most_rad)));
  return {0.0F, hips_m, 2.5F};
}

}  // namespace posed::drivers::emulate
