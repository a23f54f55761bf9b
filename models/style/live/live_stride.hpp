// LiveStride: what a walker's legs do at this moment: how far they swing and how fast they stride.
// The leg signal and its speed go round an ellipse once a stride; both figures are of that motion,
// so that they are known after a fraction of a stride (README.md, "Gate"). RT-safe.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace posed::style {

class LiveStride {
 public:
  // The leg signal [rad] `dt_s` after the last one. `cadence_rad_s` is a usual one; it brings the
  // speed to the scale of the signal.
  void update(double leg_rad, double dt_s, double cadence_rad_s) noexcept;

  // Half the distance between the extremes of the swing [rad]; 0 where the legs rest, in any pose.
  [[nodiscard]] double swing_rad() const noexcept;

  // Of the last half second or so [rad/s]; NaN until 0.3 s are known.
  [[nodiscard]] double cadence_rad_s() const noexcept;

  // The cadence is that of what comes from now on.
  void forget_cadence() noexcept { turns_ = 0; }

 private:
  struct Turn {
    double time_s, angle_rad;
  };
  static constexpr std::size_t kParts = 4;  // of the window that the largest speed is of
  static constexpr std::size_t kTurns = 9;  // angles that are kept

  void keep_speed(double dt_s) noexcept;
  void keep_turn(double dt_s) noexcept;

  bool started_ = false;
  double level_rad_ = 0.0;  // the signal, smoothed
  double speed_rad_ = 0.0;  // its speed over the cadence
  std::array<double, kParts> fastest_rad_{};
  double part_s_ = 0.0;  // of the newest part
  double time_s_ = 0.0, angle_rad_ = 0.0;
  std::array<Turn, kTurns> turn_{};  // turn_[turns_ % kTurns] is the oldest or not there yet
  std::size_t turns_ = 0;
};

}  // namespace posed::style
