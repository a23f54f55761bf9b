#include "models/feet/leg_reach.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/rotation.hpp"
#include "proto/frame/smooth_step.hpp"

namespace posed::feet {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStraight = 0.1;     // below this sine of the knee's bend its hinge leads
constexpr double kReversed = 0.35;    // a knee that is bent backwards by more is built that way
constexpr double kEase = 0.15;        // of the leg's length and rad: over it a knee turns forward
constexpr double kSoftFrom = 0.99;    // of the leg's length: beyond, it straightens ever slower
constexpr double kMaxReach = 0.9995;  // a leg is never quite straight
constexpr double kMinReach = 0.3;
constexpr double kUnder = 0.7, kAside = 0.9;  // of the leg's length: how far a foot is aside

std::size_t at(int joint) { return joint; }

// The distance that the leg makes of a wanted one. A leg that is straighter already stays so.
double reachable_m(double wanted_m, double now_m, double length_m) {
  const double longest_m = std::max(kMaxReach * length_m, std::min(now_m, length_m));
  const double soft_m = std::min(std::max(kSoftFrom * length_m, now_m), longest_m);
  if (wanted_m <= soft_m) return std::max(wanted_m, std::min(now_m, kMinReach * length_m));
  const double room_m = longest_m - soft_m;
  if (room_m <= 0.0) return longest_m;
  return longest_m - room_m * std::exp(-(wanted_m - soft_m) / room_m);
}

// Where the ankle goes that is out of reach: above where it was wanted, so that it does not slide
// over the ground. A leg that is stretched aside reaches towards it.
Vector3d raised(const Vector3d& wanted_m, double reach_m) {
  const double aside_m = std::hypot(wanted_m.x(), wanted_m.z());
  const double share = smooth_step((kAside - aside_m / reach_m) / (kAside - kUnder));
  if (share <= 0.0 || wanted_m.norm() <= reach_m) return wanted_m;
  const double down_m = std::sqrt(reach_m * reach_m - aside_m * aside_m);
  const Vector3d above(wanted_m.x(), std::copysign(down_m, wanted_m.y()), wanted_m.z());
  return share * above + (1.0 - share) * reach_m / wanted_m.norm() * wanted_m;
}

// How a knee is bent: about its own bend, or near straight, where that is noise, about its hinge.
struct Knee {
  Vector3d axis;         // in the world, normalized
  double now_rad;        // about the axis; negative where the knee is over-straight
  double sideways_rad2;  // squared angle of the bend that is not about the axis
};

Knee knee_of(const Vector3d& bend, const Vector3d& hinge, double angle_rad) {
  const double sine = bend.norm();
  const double forward = bend.dot(hinge);
  if (forward < -kReversed) return {.axis = bend / sine, .now_rad = angle_rad, .sideways_rad2 = 0};
  if (sine < 1e-9) return {.axis = hinge, .now_rad = 0.0, .sideways_rad2 = 0.0};
  const double own = std::clamp(forward / kStraight, 0.0, 1.0);
  const double share = forward / sine;
  const double sideways_rad2 =
      angle_rad * angle_rad * std::max(0.0, 1.0 - share * share) * (1.0 - own);
  const double about_rad = std::sqrt(std::max(0.0, angle_rad * angle_rad - sideways_rad2));
  return {.axis = (own * bend / sine + (1.0 - own) * hinge).normalized(),
          .now_rad = std::copysign(about_rad, forward),
          .sideways_rad2 = sideways_rad2};
}

// The turn of a knee that bends the leg by `angle_rad` in all: forward only. `shorter` [of the
// leg's length] is what that takes off it. An over-straight knee comes forward the further the more
// is asked of it; until then the foot is let go by millimetres.
double turn_rad(const Knee& knee, double angle_rad, double shorter) {
  const double about_rad = std::sqrt(std::max(0.0, angle_rad * angle_rad - knee.sideways_rad2));
  if (knee.now_rad >= 0.0) return about_rad - knee.now_rad;
  if (shorter <= 0.0) return -about_rad - knee.now_rad;
  return std::min(1.0, shorter / (kEase * -knee.now_rad)) * (about_rad - knee.now_rad);
}

// The world axis of the knee's hinge.
Vector3d hinge_of(const Skeleton& skeleton, const Leg& leg, const LegPose& pose) {
  const Joint& joint = skeleton.joints[at(leg.shin)];
  return pose.world_rotation[at(leg.shin)] * (joint.T_world_joint.conjugate() * Vector3d::UnitX());
}

}  // namespace

RT_SAFE Reach reach(const Skeleton& skeleton, const Leg& leg, const LegPose& pose,
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
  const Vector3d bend = thigh_m.normalized().cross(shin_m.normalized());
  const Knee bent = knee_of(bend, hinge_of(skeleton, leg, pose), bend_rad(now_m));
  const double angle_rad = turn_rad(bent, bend_rad(far_m), (now_m - far_m) / (a + b));
  const Quaterniond knee(rotation_exp(Vector3d(bent.axis * angle_rad)));
  const Vector3d bent_m = thigh_m + knee * shin_m;
  const Quaterniond turn = minimal_rotation(bent_m, raised(wanted_m, bent_m.norm()));
  return {.ankle_m = hip_m + turn * bent_m, .leg_turn = turn, .knee_turn = knee};
}

RT_SAFE void write_leg(const Skeleton& skeleton, const Leg& leg, const LegPose& pose,
                       const Reach& bent, const Quaterniond& foot, Frame& frame) noexcept {
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
