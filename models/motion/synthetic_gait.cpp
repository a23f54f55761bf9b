#include "models/motion/synthetic_gait.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/frame/rotation.hpp"

namespace posed::motion {
namespace {

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
