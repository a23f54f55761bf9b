// Gait: where the feet of a synthetic walker stand and how they travel from step to step. A foot
// lands on its heel, stands flat, rolls over its ball and swings, so that what stands does not
// slide. The legs follow from feet and pelvis by inverse kinematics. Cold.
#pragma once

#include <array>
#include <optional>

#include <Eigen/Geometry>

#include "models/motion/synthetic_round.hpp"

namespace posed::motion {

// +Y is up; a walker begins at the origin and walks towards +Z. Sides: 0 left, 1 right.
inline constexpr std::array<double, 2> kSideSign{1.0, -1.0};  // of X

struct LegLengths {
  double thigh_m = 0.0, shin_m = 0.0;
  double ankle_m = 0.0;        // height of the ankle over the floor
  double ball_m = 0.0;         // from the ankle ahead to the joint of the toes
  double ball_height_m = 0.0;  // of the joint of the toes over the floor
  double heel_m = 0.0;         // from the ankle back to the end of the heel
  double half_hips_m = 0.0;    // from the middle of the pelvis to a hip joint
  double hips_below_m = 0.0;   // from the root down to the hip joints
  [[nodiscard]] double length_m() const { return thigh_m + shin_m; }
};

struct Gait {
  LegLengths leg;
  double stride_s = 1.1;  // both steps
  double stride_m = 1.5;
  double half_width_m = 0.05;  // from the path to a foot
  double toe_out_rad = 0.1;
  double lift_m = 0.02;             // of a swinging ankle, beyond the straight way
  double strike_rad = 0.5;          // the foot's pitch when the heel lands
  double push_rad = 0.65;           // and, the other way, when the toes leave the floor
  std::optional<Round> round = {};  // where the walk goes; none: straight on
};

struct FootPose {
  Eigen::Vector3d ankle_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double pitch_rad = 0.0;  // positive: the toes are up
  double toes_rad = 0.0;   // of the toes against the foot, positive: up
};

struct LegPose {
  Eigen::Quaterniond thigh, shin, foot, toes;  // local, of a leg that hangs straight down in T
};

// The pelvis passes over a standing foot at this part of its stride.
inline constexpr double kOver = 0.218;

// The middle of the walk at a time, on the floor, and its heading about +Y.
[[nodiscard]] Eigen::Vector3d path_m(const Gait& gait, double time_s);
[[nodiscard]] double heading_rad(const Gait& gait, double time_s);

// `stride` counts strides from the right heel's landing at 0.
[[nodiscard]] FootPose foot_at(const Gait& gait, int side, double stride);

// The leg between the pelvis and a foot. A foot that is too far away is reached as far as the leg
// goes; the knee never bends the other way.
[[nodiscard]] LegPose reach(const LegLengths& leg, int side, const Eigen::Vector3d& root_m,
                            const Eigen::Quaterniond& pelvis, const FootPose& foot);

}  // namespace posed::motion
