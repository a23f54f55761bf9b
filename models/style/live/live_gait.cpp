#include "models/style/live/live_gait.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace posed::style {
namespace {

constexpr double kMemory_s = 0.4;     // time constant of means, variances and covariance
constexpr double kLeastSeen_s = 0.4;  // about a step
constexpr double kLeastHeight_m = 1e-3, kLeastApart_rad = 1e-2;  // standard deviations

}  // namespace

// A mean of all at first, then one that forgets. RT-safe
void LiveGait::update(double height_m, double leg_rad, double dt_s) noexcept {
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
  if (seen_s_ < kLeastSeen_s || height_m2_ < kLeastHeight_m * kLeastHeight_m ||
      apart_rad2_ < kLeastApart_rad * kLeastApart_rad) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return together_m_rad_ / std::sqrt(height_m2_ * apart_rad2_);
}

}  // namespace posed::style
