#include "models/robot/pose_solver.hpp"

#include <algorithm>
#include <cmath>

namespace posed::robot {
namespace {

constexpr double kDamping = 3e-4;   // m^2/rad^2, towards the pose of now
constexpr double kToMiddle = 1e-5;  // towards the middle of the limits: frees the null space
constexpr double kMaxStep_rad = 0.35;
constexpr double kFar_m = 0.03;  // from here on a tip pulls no harder
constexpr double kPinchPoint = 1.0;
constexpr double kPinchGap = 30.0;
constexpr double kSolverNear_m = 0.02;
constexpr double kMissing = 1.0;  // [m], of what links miss of their margin: tips gain less by it
constexpr int kBacktracks = 2;
constexpr double kShorter = 0.3;
constexpr double kTiny_rad = 1e-4;  // a further step would not show
constexpr double kLarger = 2.0, kLarger_rad = 0.01, kForgets = 0.7;

}  // namespace

PoseSolver::PoseSolver(const RobotHand& robot, double margin_m)
    : robot_(robot), margin_m_(margin_m), placed_(robot) {
  pose_ = robot.start();
  middle_.setZero();
  program_.size = robot.size();
  for (int i = 0; i < robot.size(); ++i) {
    middle_[i] = 0.5 * (robot.driven[i].low + robot.driven[i].high);
  }
}

double PoseSolver::add_residual(const Drive& slope, double residual, double weight,
                                bool slopes) noexcept {
  if (slopes) {
    for (int i = 0; i < program_.size; ++i) {
      if (slope[i] == 0.0) continue;
      program_.g[i] += weight * residual * slope[i];
      for (int j = 0; j <= i; ++j) program_.H(i, j) += weight * slope[i] * slope[j];
    }
  }
  return weight * residual * residual;
}

// Tips at their places, and thumb and finger apart in the person's direction.
double PoseSolver::add_points(const HandTarget& target, bool slopes) noexcept {
  double sum = 0.0;
  for (std::size_t f = 0; f < robot_.fingers.size(); ++f) {
    const Finger& finger = robot_.fingers[f];
    const Eigen::Vector3d tip_m = tip_of(finger, placed_);
    const Eigen::Vector3d off = tip_m - target.tip_m[f];
    const double far = off.norm();
    const double weight = target.tip_weight[f] * std::min(1.0, kFar_m / std::max(far, 1e-9));
    for (int k = 0; k < 3; ++k) {
      Drive slope = Drive::Zero();
      if (slopes) {
        add_slope(robot_, placed_, finger.tip, tip_m, Eigen::Vector3d::Unit(k), slope);
        add_residual(slope, off[k], weight, true);
      }
    }
    // Huber, so that the cost falls where the weighted squares say so.
    sum += target.tip_weight[f] * (far < kFar_m ? far * far : kFar_m * (2.0 * far - kFar_m));
    if (f == 0 || target.pinch[f] <= 0.0) continue;
    const Finger& thumb = robot_.fingers[0];
    const double apart_m = target.gap_m[f] + thumb.tip_radius_m + finger.tip_radius_m;
    const Eigen::Vector3d thumb_m = tip_of(thumb, placed_);
    const Eigen::Vector3d error = thumb_m - tip_m - apart_m * target.direction[f];
    for (int k = 0; k < 3; ++k) {
      Drive slope = Drive::Zero();
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      if (slopes) {
        add_slope(robot_, placed_, thumb.tip, thumb_m, axis, slope);
        add_slope(robot_, placed_, finger.tip, tip_m, -axis, slope);
      }
      sum += add_residual(slope, error[k], kPinchPoint * target.pinch[f], slopes);
    }
  }
  return sum;
}

// The gap between the surfaces of thumb and finger as the person's is.
double PoseSolver::add_pinches(const HandTarget& target, bool slopes) noexcept {
  double sum = 0.0;
  for (std::size_t f = 1; f < robot_.fingers.size(); ++f) {
    if (target.pinch[f] <= 0.0) continue;
    const Gap gap = gap_of_tips(robot_, placed_, robot_.fingers[0], robot_.fingers[f]);
    const double wanted_m = std::max(target.gap_m[f], margin_m_);
    sum += add_residual(gap.slope, gap.gap_m - wanted_m, kPinchGap * target.pinch[f], slopes);
  }
  return sum;
}

double PoseSolver::cost(const HandTarget& target, const Drive& pose, bool slopes) noexcept {
  place(robot_, pose, placed_);
  if (slopes) {
    program_.H.setZero();
    program_.g.setZero();
    for (int i = 0; i < program_.size; ++i) {
      program_.H(i, i) = kDamping + kToMiddle;
      program_.g[i] = kToMiddle * (pose[i] - middle_[i]);
    }
  }
  double sum = kToMiddle * (pose - middle_).squaredNorm();
  sum += add_points(target, slopes);
  sum += add_pinches(target, slopes);
  if (slopes) {
    for (int i = 0; i < program_.size; ++i) {
      for (int j = 0; j < i; ++j) program_.H(j, i) = program_.H(i, j);
    }
  }
  return sum;
}

PoseSolver::Nearness PoseSolver::nearness(std::span<const Gap> gaps) const noexcept {
  Nearness nearness;
  for (const Gap& gap : gaps) {
    nearness.overlap_m = std::max(nearness.overlap_m, -gap.gap_m);
    nearness.missing_m += std::max(0.0, margin_m_ - gap.gap_m);
  }
  return nearness;
}

// The best step within the joints' limits that keeps links apart, of those that are so near that
// turning the joints by `turn` could bring them together.
PoseSolver::Nearness PoseSolver::find_step(const Drive& turn, Drive& wanted) noexcept {
  const Near near{.most_m = kSolverNear_m, .least_m = margin_m_, .turn = &turn};
  const auto gaps = find_gaps(robot_, placed_, near, true, gaps_);
  for (std::size_t r = 0; r < gaps.size(); ++r) {
    // What is too near comes apart a little a step.
    rows_[r] = {.slope = gaps[r].slope, .least = std::min(margin_m_ - gaps[r].gap_m, 2e-3)};
  }
  program_.rows = {rows_.data(), gaps.size()};
  (void)robot::solve(program_, wanted);
  return nearness(gaps);
}

bool PoseSolver::step(const HandTarget& target) noexcept {
  const double before = cost(target, pose_, true);
  for (int i = 0; i < program_.size; ++i) {
    program_.low[i] = robot_.driven[i].low - pose_[i];
    program_.high[i] = robot_.driven[i].high - pose_[i];
  }
  // Steps are mostly as large as those before: a larger one is found again, with more links.
  Drive turn = (kLarger * lately_).array() + kLarger_rad;
  Drive wanted;
  Nearness now = find_step(turn, wanted);
  if ((wanted.cwiseAbs().array() > turn.array()).any()) {
    turn = turn.cwiseMax(kLarger * wanted.cwiseAbs());
    now = find_step(turn, wanted);
  }
  lately_ = wanted.cwiseAbs().cwiseMax(kForgets * lately_);
  if (wanted.cwiseAbs().maxCoeff() <= kTiny_rad) return false;
  if (!advance(target, before, now, wanted)) {
    look_ahead(target, wanted);
    (void)robot::solve(program_, wanted);
    if (!advance(target, before, now, wanted)) return false;
  }
  return wanted.cwiseAbs().maxCoeff() > kTiny_rad;
}

// Goes by `wanted` or the first shorter step that is a gain; if none is, `wanted` is the shortest.
bool PoseSolver::advance(const HandTarget& target, double before, const Nearness& now,
                         Drive& wanted) noexcept {
  wanted *= std::min(1.0, kMaxStep_rad / std::max(wanted.cwiseAbs().maxCoeff(), kMaxStep_rad));
  // Where the command would not keep its margin it would stand: the margin is part of the cost.
  const double most = before + kMissing * now.missing_m;
  for (int shorter = 0;; ++shorter, wanted *= kShorter) {
    const Drive there = pose_ + wanted;
    const double after = cost(target, there, false);
    if (after <= most) {
      const Nearness then =
          nearness(find_gaps(robot_, placed_, {.most_m = margin_m_}, false, gaps_));
      if (then.overlap_m <= std::max(now.overlap_m, 1e-5) &&
          after + kMissing * then.missing_m <= most) {
        pose_ = there;
        return true;
      }
    }
    if (shorter == kBacktracks) return false;
  }
}

// Links have edges: on the way they touch elsewhere than where they are nearest now, and the gap of
// thumb and finger has another slope behind an edge. So the step's program is the mean of that here
// and that at `wanted`, with rows for the pairs that are too near there: they come no nearer than
// now.
void PoseSolver::look_ahead(const HandTarget& target, const Drive& wanted) noexcept {
  const Metric H = program_.H;
  const Drive g = program_.g;
  cost(target, pose_ + wanted, true);
  program_.g = 0.5 * (g + program_.g - program_.H * wanted);
  program_.H = 0.5 * (H + program_.H);
  const auto gaps = find_gaps(robot_, placed_, {.most_m = margin_m_}, true, gaps_);
  std::size_t count = program_.rows.size();
  for (const Gap& gap : gaps) {
    const double here_m = gap.gap_m - gap.slope.dot(wanted);
    rows_[count++] = {.slope = gap.slope, .least = std::min(margin_m_ - here_m, 0.0)};
  }
  program_.rows = {rows_.data(), count};
}

const Drive& PoseSolver::solve(const HandTarget& target, int rounds) noexcept {
  for (int round = 0; round < rounds && step(target); ++round) {
  }
  for (int i = 0; i < program_.size; ++i) {
    pose_[i] = std::clamp(pose_[i], robot_.driven[i].low, robot_.driven[i].high);
  }
  return pose_;
}

}  // namespace posed::robot
