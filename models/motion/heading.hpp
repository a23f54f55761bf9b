// LiveHeading: the walking direction of a live body, that of the pelvis with the sway of the stride
// smoothed out (models/style/README.md, "Heading").
#pragma once

#include <cmath>
#include <numbers>

#include "proto/frame/rotation.hpp"

namespace posed::motion {

// Follows direction and rate of turn, so that it is on who goes round a circle. RT-safe.
class LiveHeading {
 public:
  static constexpr double kPace_rad_s = 1.0;  // of a critically damped follower
  // A turn of the pelvis within one frame that no body can make: the source has jumped.
  static constexpr double kJump_rad = std::numbers::pi / 4;

  // Advances by the direction measured `dt_s` after the last one. Returns true when the source has
  // jumped and the heading restarts.
  bool update(double measured_rad, double dt_s) noexcept {
    const double moved = posed::unwrap_near(measured_rad - last_measured_rad_, 0.0);
    const double behind = posed::unwrap_near(measured_rad - value_rad_, 0.0);
    const bool jumped = started_ && std::abs(moved) > kJump_rad && std::abs(behind) > kJump_rad;
    last_measured_rad_ = measured_rad;
    if (!started_ || jumped) {
      started_ = true;
      value_rad_ = measured_rad;
      rate_rad_s_ = 0.0;
      return jumped;
    }
    if (dt_s <= 0.0) return false;
    // Exact where the measured direction goes straight from frame to frame, so that the result does
    // not depend on their rate.
    const double step = kPace_rad_s * dt_s;
    const double kept = std::exp(-step);
    const double was_behind = behind - moved;
    const double still_behind = kept * ((1.0 - step) * was_behind - dt_s * rate_rad_s_ + moved);
    rate_rad_s_ = kept * (kPace_rad_s * step * was_behind + (1.0 + step) * rate_rad_s_) +
                  moved / dt_s * (1.0 - kept * (1.0 + step));
    value_rad_ = posed::unwrap_near(measured_rad - still_behind, 0.0);
    return false;
  }

  // The next frames go the other way in time.
  void turn_back() noexcept { rate_rad_s_ = -rate_rad_s_; }

  [[nodiscard]] double value_rad() const noexcept { return value_rad_; }

 private:
  double value_rad_ = 0.0;
  double rate_rad_s_ = 0.0;
  double last_measured_rad_ = 0.0;
  bool started_ = false;
};

}  // namespace posed::motion
