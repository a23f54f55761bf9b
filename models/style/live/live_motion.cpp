#include "models/style/live/live_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

namespace posed::style {
namespace {
constexpr double kSpeedMemory_s = 0.04;  // time constant of the low-pass
constexpr double kMemory_s = 0.4;        // time constant of means, variances and covariance
constexpr double kMinSeen_s = 0.4;       // about a step
constexpr double kMinHeight_m = 1e-3, kMinApart_rad = 1e-2;  // standard deviations
constexpr double kSmooth_s = 0.05;  // time constant of the signal's low-pass
constexpr double kPart_s = 0.1;
constexpr double kTurnsBack_strides = 0.3;  // within a stride the legs rest for less
constexpr double kFirstTurn_s = 1.0 / 30.0, kBetweenTurns_s = 1.0 / 15.0;
constexpr double kMinSpan_s = 0.3;  // for a cadence
constexpr double kRounding_s = 1e-6;

// What happens at times that do not depend on the rate of the frames.
int part_at(double time_s, double length_s) noexcept {
  return static_cast<int>(std::floor((time_s + kRounding_s) / length_s));
}

}  // namespace

RT_SAFE void PoseSpeed::update(const TrainedMotion& known, std::span<const float> q,
                               std::span<const std::uint8_t> available, double dt_s) noexcept {
  const std::span<float> last(last_.data(), q.size());
  if (dims_ == q.size() && dt_s > 0.0) {
    const double speed_deg_s = known.turn_deg(last, q, available) / dt_s;
    if (std::isnan(speed_deg_s_)) {
      speed_deg_s_ = speed_deg_s;
    } else if (!std::isnan(speed_deg_s)) {
      speed_deg_s_ -= std::expm1(-dt_s / kSpeedMemory_s) * (speed_deg_s - speed_deg_s_);
    }
  }
  dims_ = q.size();
  for (std::size_t d = 0; d < q.size(); ++d) {
    if (available[d] != 0) last[d] = q[d];
  }
}

// A mean of all at first, then one that forgets.
RT_SAFE void LiveGait::update(double height_m, double leg_rad, double dt_s) noexcept {
  const double apart_rad = std::abs(leg_rad);
  if (seen_s_ == 0.0) {
    height_m_ = height_m;
    apart_rad_ = apart_rad;
    height_m2_ = apart_rad2_ = together_m_rad_ = 0.0;
  }
  if (dt_s <= 0.0) return;
  seen_s_ += dt_s;
  const double part = std::max(-std::expm1(-dt_s / kMemory_s), dt_s / (seen_s_ + dt_s));
  const double up_m = height_m - height_m_;
  const double wider_rad = apart_rad - apart_rad_;
  height_m_ += part * up_m;
  apart_rad_ += part * wider_rad;
  height_m2_ = (1.0 - part) * (height_m2_ + part * up_m * up_m);
  apart_rad2_ = (1.0 - part) * (apart_rad2_ + part * wider_rad * wider_rad);
  together_m_rad_ = (1.0 - part) * (together_m_rad_ + part * up_m * wider_rad);
}

double LiveGait::correlation() const noexcept {
  if (seen_s_ < kMinSeen_s || height_m2_ < kMinHeight_m * kMinHeight_m ||
      apart_rad2_ < kMinApart_rad * kMinApart_rad) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return together_m_rad_ / std::sqrt(height_m2_ * apart_rad2_);
}

double LiveGait::bounce_m() const noexcept {
  return seen_s_ < kMinSeen_s ? 0.0 : std::sqrt(2.0 * height_m2_);
}

RT_SAFE void LiveStride::update(double leg_rad, double dt_s, double cadence_rad_s) noexcept {
  if (!started_) level_rad_ = leg_rad_ = leg_rad;
  started_ = true;
  if (dt_s <= 0.0) {
    leg_rad_ = leg_rad;
    return;
  }
  // The low-pass of a signal that goes straight from frame to frame, and its speed at this instant,
  // so that neither depends on the rate.
  const double slope_rad = kSmooth_s * (leg_rad - leg_rad_) / dt_s;
  level_rad_ =
      leg_rad - slope_rad + (level_rad_ - leg_rad_ + slope_rad) * std::exp(-dt_s / kSmooth_s);
  leg_rad_ = leg_rad;
  speed_rad_ = (leg_rad_ - level_rad_) / (kSmooth_s * cadence_rad_s);
  const double window_s = kTurnsBack_strides * 2.0 * std::numbers::pi / cadence_rad_s;
  parts_ = std::min(kParts, static_cast<std::size_t>(std::ceil(window_s / kPart_s - 1e-6)) + 1);
  const double before_s = std::exchange(time_s_, time_s_ + dt_s);
  keep_speed(before_s);
  keep_turn(before_s);
}

RT_SAFE void LiveStride::keep_speed(double before_s) noexcept {
  const int begun = part_at(time_s_, kPart_s) - part_at(before_s, kPart_s);
  for (int i = 0; i < std::min<int>(begun, kParts); ++i) {
    std::ranges::copy_backward(fastest_rad_.begin(), fastest_rad_.end() - 1, fastest_rad_.end());
    fastest_rad_[0] = 0.0;
  }
  fastest_rad_[0] = std::max(fastest_rad_[0], std::abs(speed_rad_));
}

RT_SAFE void LiveStride::keep_turn(double before_s) noexcept {
  const double now_rad = std::atan2(-speed_rad_, level_rad_);
  angle_rad_ += std::remainder(now_rad - angle_rad_, 2.0 * std::numbers::pi);
  const int part = part_at(time_s_ - kFirstTurn_s, kBetweenTurns_s);
  const bool begins = part > part_at(before_s - kFirstTurn_s, kBetweenTurns_s);
  if (part < 0 || (turns_ > 0 && !begins)) return;
  turn_[turns_ % kTurns] = {time_s_, angle_rad_};
  turns_ = turns_ + 1 < 2 * kTurns ? turns_ + 1 : kTurns;
}

RT_SAFE void LiveStride::turn_back() noexcept {
  forget_cadence();
  fastest_rad_.fill(fastest_rad());
  level_rad_ = 2.0 * leg_rad_ - level_rad_;  // as if the low-pass had come from the other side
  speed_rad_ = -speed_rad_;
}

double LiveStride::fastest_rad() const noexcept {
  return *std::ranges::max_element(std::span(fastest_rad_).first(parts_));
}

// A pose of long steps that is held has a level but no speed.
double LiveStride::swing_rad() const noexcept {
  return std::min(std::hypot(level_rad_, speed_rad_), fastest_rad());
}

double LiveStride::cadence_rad_s() const noexcept {
  const Turn& oldest = turn_[turns_ < kTurns ? 0 : turns_ % kTurns];
  const double span_s = time_s_ - oldest.time_s;
  if (turns_ == 0 || span_s < kMinSpan_s) return std::numeric_limits<double>::quiet_NaN();
  return (angle_rad_ - oldest.angle_rad) / span_s;
}

}  // namespace posed::style
