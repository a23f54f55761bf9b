// Gait: where the feet of a synthetic walker stand and how they travel from step to step. A foot
// lands on its heel, stands flat, rolls over its ball and swings, so that what stands does not
// slide. The legs follow from feet and pelvis by inverse kinematics. Cold.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

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

// A round of a synthetic walker: he walks, turns about, stops, stands, starts and walks on, twice,
// so that he is back where he began and can go round for ever. His steps are always in time; where
// he stands they have no length. Cold.

// Everything goes by strides, counted from the begin of the walk, and repeats after strides().
class Round {
 public:
  // A walker stands over a foot at `over`, a share of a stride, and half a stride later over the
  // other: there he begins and ends to stand. `strides` is whole and at least kMinStrides.
  Round(double stride_m, double strides, double over);
  static constexpr double kMinStrides = 12.0;

  [[nodiscard]] double strides() const { return 2.0 * half_; }
  [[nodiscard]] Eigen::Vector3d at_m(double stride) const;  // on the floor
  [[nodiscard]] double heading_rad(double stride) const;    // about +Y, does not jump at a round
  [[nodiscard]] double pace(double stride) const;           // of the path: 0 stands, 1 walks
  [[nodiscard]] double swing(double stride) const;          // of the body: 0 still, 1 as it walks
  [[nodiscard]] double turn_rad_per_stride(double stride) const;  // to the left

 private:
  [[nodiscard]] double in_half(double stride) const;
  [[nodiscard]] double from_rest(double stride) const;  // from the middle of standing

  struct Place {
    double x_m = 0.0, z_m = 0.0, heading_rad = 0.0;
  };
  [[nodiscard]] Place place(double in_half) const;

  double half_, rest_;         // strides of half a round, and the middle of standing in it
  std::vector<Place> places_;  // of the first half, equally far apart in time
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
