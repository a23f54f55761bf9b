#include "models/robot/hand_target.hpp"

#include <algorithm>

#include "proto/frame/smooth_step.hpp"

namespace posed::robot {
namespace {

constexpr double kPinchFrom_m = 5e-3;  // surfaces that are nearer touch
constexpr double kPinchOver_m = 40e-3;
constexpr double kLessTip = 0.9;  // a pinch takes that much of the weight of a tip's own target

}  // namespace

HandTargets::HandTargets(const RobotHand& robot, const hand::HandGeometry& person)
    : robot_(robot), person_(person) {
  const std::size_t fingers = robot.fingers.size();
  for (std::size_t f = 1; f < fingers; ++f) {
    double length_m = 0.0;
    for (const double bone_m : person.fingers[robot.fingers[f].human].length_m) length_m += bone_m;
    scale_[f] = robot.fingers[f].length_m / length_m;
  }
  scale_[0] = 0.5 * (scale_[1] + scale_[2]);
}

Eigen::Vector3d HandTargets::to_robot(const Eigen::Vector3d& person) const noexcept {
  return robot_.palm * Eigen::Vector3d(-person.y(), person.x(), person.z());
}

void HandTargets::find(const HandAngles& angles, HandTarget& target) noexcept {
  place(person_, angles, pose_);
  const auto tip = [&](int finger) { return pose_.to_m[3 * finger + 2]; };
  const auto base = [&](int finger) { return pose_.from_m[3 * finger]; };
  const auto radius = [&](int finger) { return person_.fingers[finger].radius_m[2]; };
  const auto& fingers = robot_.fingers;
  double nearest = 0.0;
  for (std::size_t f = 1; f < fingers.size(); ++f) {
    const int person = fingers[f].human;
    target.tip_m[f] = fingers[f].knuckle_m + scale_[f] * to_robot(tip(person) - base(person));
    const Eigen::Vector3d apart = tip(0) - tip(person);
    const double distance_m = apart.norm();
    const double gap_m = std::max(0.0, distance_m - radius(0) - radius(person));
    const double far = smooth_step((gap_m - kPinchFrom_m) / kPinchOver_m);
    target.direction[f] = distance_m > 1e-6 ? Eigen::Vector3d(to_robot(apart) / distance_m)
                                            : Eigen::Vector3d(robot_.palm.col(0));
    target.gap_m[f] = gap_m * ((1.0 - far) + far * scale_[0]);
    target.pinch[f] = 1.0 - far;
    target.tip_weight[f] = 1.0 - kLessTip * target.pinch[f];
    nearest = std::max(nearest, target.pinch[f]);
  }
  const Eigen::Vector3d knuckles = 0.5 * (fingers[1].knuckle_m + fingers[2].knuckle_m);
  const Eigen::Vector3d middle = 0.5 * (base(fingers[1].human) + base(fingers[2].human));
  target.tip_m[0] = knuckles + scale_[0] * to_robot(tip(0) - middle);
  target.tip_weight[0] = 1.0 - kLessTip * nearest;
}

}  // namespace posed::robot
