#include "models/robot/command.hpp"

#include <algorithm>
#include <cmath>

namespace posed::robot {
namespace {

constexpr double kMaxStep_s = 0.1;
constexpr double kNoNeed_s = 50e-6;  // a shorter step only brakes
constexpr double kNear_m = 0.03;     // from which on a pair's approach is limited
constexpr double kSeen_m = 1e-4;     // beyond the margin: links in contact
constexpr double kPart_m_s = 0.06;   // at which links come apart that are nearer than the margin
constexpr double kGapShare = 0.5;    // of the joints' braking that a gap counts on
constexpr double kLastShare = 0.9;   // of a gap that one step may take at the last
constexpr double kRounding = 0.995;  // of the limits: what is sent is a float
constexpr double kSame_m = 1e-6;
constexpr double kAway_rad = 0.05;  // from here on a pose is another one
constexpr double kStands_rad_s = 0.05;
constexpr int kHalvings = 5;

// The speed at which `left` may be approached in the next step, and be stopped before by braking at
// `a`: v dt + v^2 / 2a <= left. Whatever the next steps last, each can keep it (README, "Limits").
RT_SAFE double stopping_speed(double left, double a, double dt) noexcept {
  if (!(left > 0.0)) return 0.0;
  const double step = a * dt;
  return std::max(0.0, std::sqrt(step * step + 2.0 * a * left) - step);
}

}  // namespace

Command::Command(const RobotHand& robot, double margin_m)
    : robot_(robot), margin_m_(margin_m), placed_(robot), pose_(robot.start()) {
  program_.size = robot.size();
}

// The steps that keep limits of position, speed and acceleration. Never empty: braking is in it.
void Command::find_box(double dt_s) noexcept {
  for (int i = 0; i < robot_.size(); ++i) {
    const DrivenJoint& joint = robot_.driven[i];
    const double a = kRounding * joint.acceleration;
    const double most = kRounding * joint.speed;
    const double up = stopping_speed(joint.high - pose_[i], a, dt_s);
    const double down = stopping_speed(pose_[i] - joint.low, a, dt_s);
    double low = std::max({-most, velocity_[i] - a * dt_s, -down});
    double high = std::min({most, velocity_[i] + a * dt_s, up});
    if (low > high) low = high = std::clamp(0.5 * (low + high), -down, up);  // rounding
    program_.low[i] = low * dt_s;
    program_.high[i] = high * dt_s;
  }
}

// Whether links would overlap more than they do: `gaps` are those of now.
bool Command::would_enter(const Drive& pose, std::span<const Gap> gaps) noexcept {
  place(robot_, pose, placed_);
  return std::ranges::any_of(find_gaps(robot_, placed_, {}, false, there_), [&](const Gap& there) {
    const auto now = std::ranges::find_if(
        gaps, [&](const Gap& gap) { return gap.a == there.a && gap.b == there.b; });
    const double allowed_m = now == gaps.end() ? 0.0 : std::min(now->gap_m, 0.0);
    return !(there.gap_m >= allowed_m - kSame_m);
  });
}

// Counts an aim that a row forbids, and remembers whose gap does most.
void Command::find_in_the_way(std::span<const Gap> gaps, const Drive& aim) noexcept {
  double most = kSame_m;
  for (std::size_t r = 0; r < gaps.size(); ++r) {
    const double forbidden_m = rows_[r].least - rows_[r].slope.dot(aim);
    if (forbidden_m <= most) continue;
    most = forbidden_m;
    in_the_way_ = {gaps[r].a, gaps[r].b};
  }
  if (most > kSame_m) ++limited_;
}

// Rows by which links keep `margin_m`, or come back to it.
void Command::find_rows(std::span<const Gap> gaps, double margin_m, double dt_s) noexcept {
  for (std::size_t r = 0; r < gaps.size(); ++r) {
    double brakes = 0.0;  // of all joints together [m/s^2]
    for (int i = 0; i < robot_.size(); ++i) {
      brakes += std::abs(gaps[r].slope[i]) * robot_.driven[i].acceleration;
    }
    const double left_m = gaps[r].gap_m - margin_m;
    const double least_m_s = left_m > 0.0 ? -stopping_speed(left_m, kGapShare * brakes, dt_s)
                                          : std::min(kPart_m_s, -left_m / (10.0 * dt_s));
    rows_[r] = {.slope = gaps[r].slope, .least = least_m_s * dt_s};
  }
  program_.rows = {rows_.data(), gaps.size()};
}

// The step nearest to `aim` that keeps the links apart. False: only by breaking an acceleration.
bool Command::keep_apart(std::span<const Gap> gaps, const Drive& aim, double dt_s,
                         Drive& step) noexcept {
  find_rows(gaps, margin_m_, dt_s);
  in_contact_ =
      std::ranges::any_of(gaps, [&](const Gap& gap) { return gap.gap_m < margin_m_ + kSeen_m; });
  find_in_the_way(gaps, aim);
  program_.g = -aim;
  program_.H.setIdentity();
  if (robot::solve(program_, step)) return true;
  const auto only_stand = [&] {
    for (StepRow& row : rows_) row.least = std::min(row.least, 0.0);
  };
  only_stand();
  if (robot::solve(program_, step)) return true;
  // An acceleration goes before the margin: it is there to be used up before links meet.
  find_rows(gaps, 0.0, dt_s);
  only_stand();
  if (robot::solve(program_, step)) return true;
  for (std::size_t r = 0; r < gaps.size(); ++r) {
    rows_[r].least = std::min(rows_[r].least, -kLastShare * gaps[r].gap_m);
  }
  if (robot::solve(program_, step)) return true;
  // Standing still is always allowed.
  for (int i = 0; i < robot_.size(); ++i) {
    program_.low[i] = std::min(program_.low[i], 0.0);
    program_.high[i] = std::max(program_.high[i], 0.0);
  }
  if (!robot::solve(program_, step)) step.setZero();
  return false;
}

void Command::move(const Drive& aim, double dt_s) noexcept {
  Drive step = aim;
  place(robot_, pose_, placed_);
  // Which rows can bind: with all joints at v at most, theirs do from v dt + v^2 / 2a on, where a
  // is what keep_apart() gives them.
  Drive turn = Drive::Zero();
  for (int i = 0; i < robot_.size(); ++i) {
    const double most = std::max(-program_.low[i], program_.high[i]) / dt_s;
    turn[i] = most * dt_s + most * most / (2.0 * kGapShare * robot_.driven[i].acceleration);
  }
  const Near near{.most_m = kNear_m, .least_m = margin_m_ + kSeen_m, .turn = &turn};
  const auto gaps = find_gaps(robot_, placed_, near, true, gaps_);
  bool is_soft = keep_apart(gaps, aim, dt_s, step);
  // The rows are straight and the links' ways are not: what would overlap more goes less far.
  int halving = 0;
  while (halving < kHalvings && would_enter(pose_ + step, gaps)) {
    step *= 0.5;
    ++halving;
  }
  if (halving == kHalvings) step.setZero();
  if (halving > 0) is_soft = false;
  if (!is_soft) ++hard_stops_;
  for (int i = 0; i < robot_.size(); ++i) {
    const DrivenJoint& joint = robot_.driven[i];
    pose_[i] = std::clamp(pose_[i] + step[i], joint.low, joint.high);
    velocity_[i] = step[i] / dt_s;
  }
}

// Once told it is forgotten: what is wanted next may be reached.
void Command::find_blocked(const Drive& wanted, double dt_s) noexcept {
  if (blocked()) blocked_s_ = 0.0;
  const bool stands = velocity_.cwiseAbs().maxCoeff() < kStands_rad_s;
  const bool away = (wanted - pose_).cwiseAbs().maxCoeff() > kAway_rad;
  blocked_s_ = stands && away ? blocked_s_ + dt_s : 0.0;
  if (blocked() && !is_stopped_) ++stops_;
  is_stopped_ = stands && away && (is_stopped_ || blocked());
}

void Command::follow(const Drive& wanted, double dt_s) noexcept {
  if (!wanted.allFinite() || !(dt_s > kNoNeed_s)) return brake(dt_s);
  dt_s = std::min(dt_s, kMaxStep_s);
  find_box(dt_s);
  Drive aim = Drive::Zero();
  for (int i = 0; i < robot_.size(); ++i) {
    const double left = wanted[i] - pose_[i];
    const double a = 0.9 * robot_.driven[i].acceleration;
    aim[i] = std::copysign(stopping_speed(std::abs(left), a, dt_s) * dt_s, left);
    aim[i] = std::clamp(aim[i], program_.low[i], program_.high[i]);
  }
  move(aim, dt_s);
  find_blocked(wanted, dt_s);
}

void Command::brake(double dt_s) noexcept {
  blocked_s_ = 0.0;
  if (!(dt_s > 0.0) || stands()) return;
  dt_s = std::min(dt_s, kMaxStep_s);
  find_box(dt_s);
  Drive aim = Drive::Zero();
  for (int i = 0; i < robot_.size(); ++i) {
    aim[i] = std::clamp(0.0, program_.low[i], program_.high[i]);
  }
  move(aim, dt_s);
}

}  // namespace posed::robot
