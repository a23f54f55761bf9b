#include "models/motion/synthetic_gait.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/frame/rotation.hpp"
#include "proto/frame/smooth_step.hpp"

namespace posed::motion {
namespace {

constexpr int kPlaces = 4096;
constexpr double kStands = 1.5;  // strides from the last step's place to the first step
constexpr double kRamp = 0.9;    // strides in which he comes to his pace or to rest
constexpr double kRest = 0.85;   // the middle of standing, a share of half a round
// The turn, shares of half a round; it is wide, because a style sees a walker from a heading that
// follows him within a second.
constexpr double kTurnFrom = 0.02, kTurnTo = 0.7, kTurnEase = 0.15;

// Like smooth_step, but quick at first: the first step is a third of a stride already.
double setting_off(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (6.0 - 8.0 * x + 3.0 * x * x);
}

// 0 outside of the turn, 1 within.
double turning(double share) {
  const double u = (share - kTurnFrom) / (kTurnTo - kTurnFrom);
  return smooth_step(std::min(u, 1.0 - u) / kTurnEase);
}

// Parts of a stride, from the landing of the heel, as in the usual description of gait (Perry,
// "Gait Analysis", 1992): foot flat, heel rise, toes off.
constexpr double kFlat = 0.04, kRise = 0.216, kOff = 0.545;

// How far a foot goes from this step to the next, of a usual stride: what stands does not roll.
double share_of_stride(const Gait& gait, double time_s) {
  if (!gait.round) return 1.0;
  const double ahead_m = (path_m(gait, time_s + gait.stride_s) - path_m(gait, time_s)).norm();
  return std::min(1.0, ahead_m / gait.stride_m);
}

double passes_over_s(const Gait& gait, int side, double step) {
  return (step + (side == 0 ? 0.5 : 0.0) + kOver) * gait.stride_s;
}

// The cubic through two values with given slopes, at `x` from 0 to 1.
template <typename Value>
Value cubic(const Value& from, const Value& from_slope, const Value& to, const Value& to_slope,
            double x) {
  const double xx = x * x, xxx = xx * x;
  return from * (2.0 * xxx - 3.0 * xx + 1.0) + from_slope * (xxx - 2.0 * xx + x) +
         to * (3.0 * xx - 2.0 * xxx) + to_slope * (xxx - xx);
}

Eigen::Quaterniond turned(double yaw_rad, double pitch_rad) {
  return axis_rotation(Axis::kY, yaw_rad) * axis_rotation(Axis::kX, -pitch_rad);
}

double standing_pitch(const Gait& gait, double time_s, double part) {
  if (part < kFlat) {
    return share_of_stride(gait, time_s - gait.stride_s) * gait.strike_rad *
           (1.0 - smooth_step(part / kFlat));
  }
  const double rise = std::max(0.0, (part - kRise) / (kOff - kRise));
  return -share_of_stride(gait, time_s) * gait.push_rad * std::pow(rise, 5.0);
}

// A foot of this step while it touches the floor.
FootPose standing(const Gait& gait, int side, double step, double part) {
  const double time_s = passes_over_s(gait, side, step);
  const double heading = heading_rad(gait, time_s);
  const LegLengths& leg = gait.leg;
  FootPose foot;
  foot.yaw_rad = heading + kSideSign[side] * gait.toe_out_rad;
  foot.pitch_rad = standing_pitch(gait, time_s, part);
  foot.toes_rad = std::max(0.0, -foot.pitch_rad);
  const Eigen::Vector3d flat_m = path_m(gait, time_s) +
                                 axis_rotation(Axis::kY, heading) *
                                     Eigen::Vector3d(kSideSign[side] * gait.half_width_m, 0, 0) +
                                 Eigen::Vector3d(0, leg.ankle_m, 0);
  // The foot turns about its heel or about the joint of its toes, which stay where they are.
  const Eigen::Vector3d pivot_m =
      foot.pitch_rad > 0.0 ? Eigen::Vector3d(0, -leg.ankle_m, -leg.heel_m)
                           : Eigen::Vector3d(0, leg.ball_height_m - leg.ankle_m, leg.ball_m);
  foot.ankle_m =
      flat_m + turned(foot.yaw_rad, 0.0) * pivot_m - turned(foot.yaw_rad, foot.pitch_rad) * pivot_m;
  return foot;
}

}  // namespace

Round::Round(double stride_m, double strides, double over)
    : half_(0.5 * strides),
      rest_(over + 0.5 * kStands + 0.5 * std::floor(2.0 * (kRest * half_ - over) - kStands)),
      places_(kPlaces + 1) {
  const double step = half_ / kPlaces;
  for (int i = 0; i < kPlaces; ++i) {
    const double stride = (i + 0.5) * step;
    const double turn = turn_rad_per_stride(stride) * step, ahead = stride_m * pace(stride) * step;
    const Place& from = places_[i];
    const double heading = from.heading_rad + 0.5 * turn;
    places_[i + 1] = {.x_m = from.x_m + ahead * std::sin(heading),
                      .z_m = from.z_m + ahead * std::cos(heading),
                      .heading_rad = from.heading_rad + turn};
  }
}

double Round::in_half(double stride) const { return stride - half_ * std::floor(stride / half_); }

Round::Place Round::place(double in_half) const {
  const double at = in_half / half_ * kPlaces;
  const int before = std::min(static_cast<int>(at), kPlaces - 1);
  const double share = at - before;
  const Place &a = places_[before], &b = places_[before + 1];
  return {.x_m = a.x_m + share * (b.x_m - a.x_m),
          .z_m = a.z_m + share * (b.z_m - a.z_m),
          .heading_rad = a.heading_rad + share * (b.heading_rad - a.heading_rad)};
}

// The second half is the first one, begun where that ends and turned by half a turn.
Eigen::Vector3d Round::at_m(double stride) const {
  const Place here = place(in_half(stride));
  const Eigen::Vector3d at(here.x_m, 0.0, here.z_m);
  const bool second = std::fmod(std::floor(stride / half_), 2.0) != 0.0;
  return second ? Eigen::Vector3d(places_.back().x_m, 0.0, places_.back().z_m) - at : at;
}

double Round::heading_rad(double stride) const {
  return std::numbers::pi * std::floor(stride / half_) + place(in_half(stride)).heading_rad;
}

double Round::from_rest(double stride) const {
  return std::abs(std::remainder(stride - rest_, half_));
}

double Round::pace(double stride) const {
  return setting_off((from_rest(stride) - 0.5 * kStands) / kRamp);
}

// The body sways before the first step's foot leaves the floor, and until the last one has landed.
double Round::swing(double stride) const {
  return smooth_step(from_rest(stride) - 0.5 * kStands + 0.4);
}

double Round::turn_rad_per_stride(double stride) const {
  const double least = (kTurnTo - kTurnFrom) * (1.0 - kTurnEase) * half_;
  return std::numbers::pi / least * turning(in_half(stride) / half_);
}

double heading_rad(const Gait& gait, double time_s) {
  return gait.round ? gait.round->heading_rad(time_s / gait.stride_s) : 0.0;
}

Eigen::Vector3d path_m(const Gait& gait, double time_s) {
  if (gait.round) return gait.round->at_m(time_s / gait.stride_s);
  return {0.0, 0.0, gait.stride_m / gait.stride_s * time_s};
}

FootPose foot_at(const Gait& gait, int side, double stride) {
  const double own = stride - (side == 0 ? 0.5 : 0.0);
  const double step = std::floor(own);
  const double part = own - step;
  if (part < kOff) return standing(gait, side, step, part);
  const double swing = (part - kOff) / (1.0 - kOff);
  constexpr double kSmall = 1e-4;  // of a stride, for the slopes at both ends
  const FootPose before = standing(gait, side, step, kOff - kSmall);
  const FootPose from = standing(gait, side, step, kOff);
  const FootPose to = standing(gait, side, step + 1.0, 0.0);
  const FootPose after = standing(gait, side, step + 1.0, kSmall);
  constexpr double kPerSwing = (1.0 - kOff) / kSmall;
  FootPose foot;
  foot.ankle_m =
      cubic<Eigen::Vector3d>(from.ankle_m, kPerSwing * (from.ankle_m - before.ankle_m), to.ankle_m,
                             kPerSwing * (after.ankle_m - to.ankle_m), swing);
  const double share = share_of_stride(gait, passes_over_s(gait, side, step));
  foot.ankle_m.y() +=
      std::sqrt(share) * gait.lift_m * std::pow(std::sin(std::numbers::pi * swing), 2.0);
  foot.yaw_rad = from.yaw_rad + (to.yaw_rad - from.yaw_rad) * smooth_step(swing);
  foot.pitch_rad = cubic(from.pitch_rad, kPerSwing * (from.pitch_rad - before.pitch_rad),
                         to.pitch_rad, kPerSwing * (after.pitch_rad - to.pitch_rad), swing);
  foot.toes_rad = std::max(0.0, -foot.pitch_rad) * (1.0 - smooth_step(swing));
  return foot;
}

LegPose reach(const LegLengths& leg, int side, const Eigen::Vector3d& root_m,
              const Eigen::Quaterniond& pelvis, const FootPose& foot) {
  const Eigen::Vector3d hip_m =
      root_m + pelvis * Eigen::Vector3d(kSideSign[side] * leg.half_hips_m, -leg.hips_below_m, 0);
  const Eigen::Vector3d way_m = foot.ankle_m - hip_m;
  const double far_m = std::min(way_m.norm(), 0.9995 * leg.length_m());
  const Eigen::Vector3d down = way_m.normalized();
  // The knee's axis points to the left and lies square to the foot's direction.
  const Eigen::Vector3d ahead = axis_rotation(Axis::kY, foot.yaw_rad) * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = (-down).cross(ahead).normalized();
  const double a = leg.thigh_m, b = leg.shin_m;
  const double at_hip =
      std::acos(std::clamp((a * a + far_m * far_m - b * b) / (2.0 * a * far_m), -1.0, 1.0));
  const double knee =
      std::numbers::pi -
      std::acos(std::clamp((a * a + b * b - far_m * far_m) / (2.0 * a * b), -1.0, 1.0));
  Eigen::Matrix3d straight;  // a leg whose ankle lies where the foot is
  straight << axis, -down, axis.cross(-down);
  const Eigen::Quaterniond thigh(straight * axis_rotation(Axis::kX, -at_hip).toRotationMatrix());
  const Eigen::Quaterniond shin = axis_rotation(Axis::kX, knee);
  LegPose pose;
  pose.thigh = pelvis.conjugate() * thigh;
  pose.shin = shin;
  pose.foot = (thigh * shin).conjugate() * turned(foot.yaw_rad, foot.pitch_rad);
  pose.toes = axis_rotation(Axis::kX, -foot.toes_rad);
  return pose;
}

}  // namespace posed::motion
