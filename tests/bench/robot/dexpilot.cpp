#include "tests/bench/robot/dexpilot.hpp"

#include <algorithm>

namespace posed::bench {
namespace {

using robot::Drive;

constexpr double kHuber_m = 0.03;
constexpr double kProject_m = 0.03, kRelease_m = 0.05;
constexpr double kTogether_m = 1e-4, kApart_m = 0.03;
constexpr double kThumbWeight = 200.0, kFingersWeight = 400.0;
constexpr double kToLast = 4e-3;
constexpr double kWiden_rad = 1e-3;
constexpr int kMaxSteps = 30;

// Its configurations' scale; 0: it has none for this robot.
double known_scale(const std::string& robot) {
  if (robot.contains("allegro") || robot.contains("leap")) return 1.6;
  if (robot.contains("shadow") || robot.contains("schunk")) return 1.2;
  if (robot.contains("inspire")) return 1.15;
  if (robot.contains("ability")) return 1.0;
  return 0.0;
}

}  // namespace

DexPilot::DexPilot(const robot::RobotHand& robot, const hand::HandGeometry& person)
    : robot_(robot), person_(person), placed_(robot.links.size()) {
  const auto fingers = static_cast<int>(robot.fingers.size());
  scale_ = known_scale(robot.name);
  const auto wrist = std::ranges::find(robot.links, "wrist", &robot::Link::name);
  place(robot, robot.start(), placed_);
  if (wrist != robot.links.end()) wrist_m_ = placed_.at_m[wrist - robot.links.begin()];
  if (scale_ == 0.0) guess_wrist();
  for (int a = 0; a < fingers; ++a) {
    for (int b = a + 1; b < fingers; ++b) {
      vectors_.push_back(
          {.from = robot.fingers[b].tip, .to = robot.fingers[a].tip, .a = a, .b = b});
    }
  }
  const double tips = static_cast<double>(vectors_.size()) + fingers;
  for (int f = 0; f < fingers; ++f) {
    vectors_.push_back({.to = robot.fingers[f].tip, .b = f, .weight = tips});
  }
  program_.size = robot.size();
  pose_ = Drive::Zero();
  for (int i = 0; i < robot.size(); ++i) {
    const robot::RobotJoint& joint = robot.joints[robot.driven[i].joint];
    pose_[i] = 0.5 * (joint.low + joint.high);
  }
  last_ = pose_;
}

// For a robot without a configuration: the scale of its fingers, and the wrist where the knuckles
// then fit best.
void DexPilot::guess_wrist() {
  hand::HandPose open;
  place(person_, HandAngles{}, open);
  const double count = static_cast<double>(robot_.fingers.size()) - 1.0;
  Eigen::Vector3d knuckles = Eigen::Vector3d::Zero(), human = Eigen::Vector3d::Zero();
  for (const robot::Finger& finger : robot_.fingers) {
    if (finger.human == 0) continue;
    const Eigen::Vector3d& base_m = open.from_m[3 * finger.human];
    scale_ += finger.length_m / (open.to_m[3 * finger.human + 2] - base_m).norm() / count;
    knuckles += finger.knuckle_m / count;
    human += base_m / count;
  }
  wrist_m_ = knuckles - scale_ * to_robot(human);
}

Eigen::Vector3d DexPilot::to_robot(const Eigen::Vector3d& person) const {
  return robot_.palm * Eigen::Vector3d(-person.y(), person.x(), person.z());
}

void DexPilot::find_targets(const HandAngles& angles) {
  hand::HandPose pose;
  place(person_, angles, pose);
  const auto tip = [&](int f) { return pose.to_m[3 * robot_.fingers[f].human + 2]; };
  std::array<bool, kFingers> projected{};
  for (Vector& vector : vectors_) {
    Eigen::Vector3d human = tip(vector.b);
    if (vector.a >= 0) human = tip(vector.a) - human;
    const double length_m = human.norm();
    double target_m = scale_ * length_m;
    if (vector.a == 0) {
      vector.projected = length_m < (vector.projected ? kRelease_m : kProject_m);
      projected[static_cast<std::size_t>(vector.b)] = vector.projected;
      vector.weight = vector.projected ? kThumbWeight : 1.0;
      if (vector.projected) target_m = kTogether_m;
    } else if (vector.a > 0) {
      const bool apart = projected[static_cast<std::size_t>(vector.a)] &&
                         projected[static_cast<std::size_t>(vector.b)] && length_m <= kApart_m;
      vector.weight = apart ? kFingersWeight : 1.0;
      if (apart) target_m = kApart_m;
    }
    vector.target_m = to_robot(human) * (target_m / std::max(length_m, 1e-9));
  }
}

double DexPilot::cost(const Drive& pose, bool slopes) {
  place(robot_, pose, placed_);
  if (slopes) {
    program_.H = 2.0 * kToLast * robot::Metric::Identity();
    program_.g = 2.0 * kToLast * (pose - last_);
  }
  double sum = kToLast * (pose - last_).squaredNorm();
  for (const Vector& vector : vectors_) {
    const Eigen::Vector3d& to_m = placed_.at_m[vector.to];
    const Eigen::Vector3d& from_m = vector.a < 0 ? wrist_m_ : placed_.at_m[vector.from];
    const Eigen::Vector3d off = to_m - from_m - vector.target_m;
    const double far = off.norm();
    const double share = vector.weight / static_cast<double>(vectors_.size());
    sum += share * (far < kHuber_m ? 0.5 * far * far / kHuber_m : far - 0.5 * kHuber_m);
    for (int k = 0; slopes && k < 3; ++k) {
      Drive slope = Drive::Zero();
      add_slope(robot_, placed_, vector.to, to_m, Eigen::Vector3d::Unit(k), slope);
      if (vector.a >= 0) {
        add_slope(robot_, placed_, vector.from, from_m, -Eigen::Vector3d::Unit(k), slope);
      }
      const double weight = share / std::max(far, kHuber_m);
      program_.g += weight * off[k] * slope;
      program_.H += weight * slope * slope.transpose();
    }
  }
  return sum;
}

bool DexPilot::step() {
  const double before = cost(pose_, true);
  for (int i = 0; i < robot_.size(); ++i) {
    const robot::RobotJoint& joint = robot_.joints[robot_.driven[i].joint];
    program_.low[i] = joint.low - kWiden_rad - pose_[i];
    program_.high[i] = joint.high + kWiden_rad - pose_[i];
  }
  Drive wanted;
  (void)robot::solve(program_, wanted);
  for (int halving = 0; halving < 8; ++halving, wanted *= 0.5) {
    if (cost(pose_ + wanted, false) >= before) continue;
    pose_ += wanted;
    return wanted.cwiseAbs().maxCoeff() > 1e-4;
  }
  return false;
}

const Drive& DexPilot::solve(const HandAngles& angles) {
  find_targets(angles);
  last_ = pose_;
  for (int i = 0; i < kMaxSteps && step(); ++i) {
  }
  return pose_;
}

}  // namespace posed::bench
