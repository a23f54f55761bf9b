// LiveHeading: the walking direction of a live body, that of the pelvis with the sway of the stride
// smoothed out (models/style/README.md, "Heading").
#pragma once

#include <cmath>
#include <numbers>

#include "proto/frame/rotation.hpp"

namespace posed::motion {

// A first-order low-pass on the circle. RT-safe.
class LiveHeading {
 public:
  static constexpr double kTau_s = 1.0;
  // A turn of the pelvis within one frame that no body can make: the source has jumped.
  static constexpr double kJump_rad = std::numbers::pi / 4;

  // Advances by the direction measured `dt_s` after the last one. Returns true when the source has
  // jumped and the low-pass restarts.
  bool update(double measured_rad, double dt_s) noexcept {
    const double moved = posed::unwrap_near(measured_rad - last_measured_rad_, 0.0);
    const double behind = posed::unwrap_near(measured_rad - value_rad_, 0.0);
    const bool jumped = started_ && std::abs(moved) > kJump_rad && std::abs(behind) > kJump_rad;
    last_measured_rad_ = measured_rad;
    if (!started_ || jumped) {
      started_ = true;
      value_rad_ = measured_rad;
      return jumped;
    }
    value_rad_ = posed::unwrap_near(value_rad_ + behind * -std::expm1(-dt_s / kTau_s), 0.0);
    return false;
  }

  // Sets the state that a long time at `value_rad` would lead to.
  void settle(double value_rad, double measured_rad) noexcept {
    started_ = true;
    value_rad_ = value_rad;
    last_measured_rad_ = measured_rad;
  }

  [[nodiscard]] double value_rad() const noexcept { return value_rad_; }

 private:
  double value_rad_ = 0.0;
  double last_measured_rad_ = 0.0;
  bool started_ = false;
};

}  // namespace posed::motion
