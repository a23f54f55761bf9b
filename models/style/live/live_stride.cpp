#include "models/style/live/live_stride.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace posed::style {
namespace {

constexpr double kSmooth_s = 0.05;  // time constant of the signal's low-pass
constexpr double kPart_s = 0.075;   // four of them: the legs rest for less within a stride
constexpr double kBetweenTurns_s = 0.06;
constexpr double kLeastSpan_s = 0.3;  // for a cadence

}  // namespace

// RT-safe
void LiveStride::update(double leg_rad, double dt_s, double cadence_rad_s) noexcept {
  if (!started_) level_rad_ = leg_rad;
  started_ = true;
  if (dt_s <= 0.0) return;
  const double step_rad = -std::expm1(-dt_s / kSmooth_s) * (leg_rad - level_rad_);
  level_rad_ += step_rad;
  speed_rad_ = step_rad / (dt_s * cadence_rad_s);
  keep_speed(dt_s);
  keep_turn(dt_s);
}

// RT-safe
void LiveStride::keep_speed(double dt_s) noexcept {
  part_s_ += dt_s;
  if (part_s_ > kPart_s) {
    std::ranges::copy_backward(fastest_rad_.begin(), fastest_rad_.end() - 1, fastest_rad_.end());
    fastest_rad_[0] = 0.0;
    part_s_ = 0.0;
  }
  fastest_rad_[0] = std::max(fastest_rad_[0], std::abs(speed_rad_));
}

// RT-safe
void LiveStride::keep_turn(double dt_s) noexcept {
  const double now_rad = std::atan2(-speed_rad_, level_rad_);
  angle_rad_ += std::remainder(now_rad - angle_rad_, 2.0 * std::numbers::pi);
  time_s_ += dt_s;
  const Turn newest = turn_[(turns_ + kTurns - 1) % kTurns];
  if (turns_ > 0 && time_s_ - newest.time_s < kBetweenTurns_s) return;
  turn_[turns_ % kTurns] = {time_s_, angle_rad_};
  turns_ = turns_ + 1 < 2 * kTurns ? turns_ + 1 : kTurns;
}

// A pose of long steps that is held has a level but no speed.
double LiveStride::swing_rad() const noexcept {
  return std::min(std::hypot(level_rad_, speed_rad_), *std::ranges::max_element(fastest_rad_));
}

double LiveStride::cadence_rad_s() const noexcept {
  const Turn& oldest = turn_[turns_ < kTurns ? 0 : turns_ % kTurns];
  const double span_s = time_s_ - oldest.time_s;
  if (turns_ == 0 || span_s < kLeastSpan_s) return std::numeric_limits<double>::quiet_NaN();
  return (angle_rad_ - oldest.angle_rad) / span_s;
}

}  // namespace posed::style
