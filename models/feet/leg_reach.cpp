#include "models/feet/leg_reach.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/rotation.hpp"

namespace posed::feet {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStraight = 0.1;    // below this sine of the knee's bend its hinge leads
constexpr double kSoftFrom = 0.97;   // of the leg's length: beyond, it straightens ever slower
constexpr double kLongest = 0.9995;  // a leg is never quite straight
constexpr double kShortest = 0.3;

std::size_t at(int joint) { return static_cast<std::size_t>(joint); }

// The distance that the leg makes of a wanted one. A leg that is straighter already stays so.
double reachable_m(double wanted_m, double now_m, double length_m) {
  const double longest_m = std::max(kLongest * length_m, std::min(now_m, length_m));
  const double soft_m = std::min(std::max(kSoftFrom * length_m, now_m), longest_m);
  if (wanted_m <= soft_m) return std::max(wanted_m, std::min(now_m, kShortest * length_m));
  const double room_m = longest_m - soft_m;
  if (room_m <= 0.0) return longest_m;
  return longest_m - room_m * std::exp(-(wanted_m - soft_m) / room_m);
}

// The world axis about which the knee bends: that of its bend, or of its hinge where it is
// straight.
Vector3d knee_axis(const Skeleton& skeleton, const Leg& leg, const LegPose& pose,
                   const Vector3d& thigh, const Vector3d& shin) {
  const Vector3d bend = thigh.normalized().cross(shin.normalized());
  const Joint& joint = skeleton.joints[at(leg.shin)];
  const Vector3d hinge =
      pose.world_rotation[at(leg.shin)] * (joint.T_world_joint.conjugate() * Vector3d::UnitX());
  const Vector3d axis = bend + std::max(0.0, kStraight - bend.norm()) * hinge;
  return axis.norm() > 1e-9 ? Vector3d(axis.normalized()) : hinge;
}

}  // namespace

// RT-safe.
Reach reach(const Skeleton& skeleton, const Leg& leg, const LegPose& pose,
            const Vector3d& ankle_m) noexcept {
  const Vector3d& hip_m = pose.from_root_m[at(leg.thigh)];
  const Vector3d& knee_m = pose.from_root_m[at(leg.shin)];
  const Vector3d thigh_m = knee_m - hip_m;
  const Vector3d shin_m = pose.from_root_m[at(leg.foot)] - knee_m;
  const double a = thigh_m.norm(), b = shin_m.norm();
  const Vector3d wanted_m = ankle_m - hip_m;
  const double now_m = (thigh_m + shin_m).norm();
  const double far_m = reachable_m(wanted_m.norm(), now_m, a + b);
  const auto bend_rad = [&](double distance_m) {
    return std::acos(
        std::clamp((distance_m * distance_m - a * a - b * b) / (2.0 * a * b), -1.0, 1.0));
  };
  const Vector3d axis = knee_axis(skeleton, leg, pose, thigh_m, shin_m);
  const Quaterniond knee(rotation_exp(Vector3d(axis * (bend_rad(far_m) - bend_rad(now_m)))));
  const Vector3d bent_m = thigh_m + knee * shin_m;
  const Quaterniond turn = minimal_rotation(bent_m, wanted_m);
  return {.ankle_m = hip_m + turn * bent_m, .leg_turn = turn, .knee_turn = knee};
}

// RT-safe.
void write_leg(const Skeleton& skeleton, const Leg& leg, const LegPose& pose, const Reach& bent,
               const Quaterniond& foot, Frame& frame) noexcept {
  const auto parent_of = [&](int joint) {
    const int parent = skeleton.joints[at(joint)].parent;
    return parent < 0 ? Quaterniond::Identity() : pose.world_rotation[at(parent)];
  };
  const Quaterniond shin_turn = bent.leg_turn * bent.knee_turn;
  const auto write = [&](int joint, const Quaterniond& parent, const Quaterniond& world) {
    set_rotation(skeleton, joint, (parent.conjugate() * world).normalized(), frame);
  };
  write(leg.thigh, parent_of(leg.thigh), bent.leg_turn * pose.world_rotation[at(leg.thigh)]);
  write(leg.shin, bent.leg_turn * parent_of(leg.shin),
        shin_turn * pose.world_rotation[at(leg.shin)]);
  write(leg.foot, shin_turn * parent_of(leg.foot), foot);
}

}  // namespace posed::feet
