#include "models/style/live/warm_up.hpp"

#include <cmath>

namespace posed::style {
namespace {

constexpr double kLeastWalked = 0.5;  // of the time

}  // namespace

// RT-safe
void WarmUp::begin(double seconds) noexcept {
  *this = {};
  seconds_ = left_s_ = seconds;
}

// RT-safe
WarmUp::Outcome WarmUp::update(std::span<const float> q, std::span<const std::uint8_t> available,
                               bool walks, double cadence_rad_s, double dt_s) noexcept {
  if (!running()) return Outcome::kNone;
  left_s_ -= dt_s;
  if (walks) {
    walked_s_ += dt_s;
    for (std::size_t d = 0; d < q.size(); ++d) {
      if (available[d] == 0) continue;
      sum_[d] += dt_s * static_cast<double>(q[d]);
      time_s_[d] += dt_s;
    }
    if (!std::isnan(cadence_rad_s)) {
      turned_rad_ += dt_s * std::abs(cadence_rad_s);
      turned_s_ += dt_s;
    }
  }
  if (running()) return Outcome::kNone;
  return walked_s_ >= kLeastWalked * seconds_ ? Outcome::kDone : Outcome::kStood;
}

// RT-safe
Walker WarmUp::walker() const noexcept {
  Walker walker;
  for (std::size_t d = 0; d < sum_.size(); ++d) {
    if (time_s_[d] <= 0.0) continue;
    walker.measured[d] = 1;
    walker.neutral[d] = static_cast<float>(sum_[d] / time_s_[d]);
  }
  if (turned_s_ > 0.0) walker.cadence_rad_s = turned_rad_ / turned_s_;
  return walker;
}

}  // namespace posed::style
