// What a walker does at this moment, for the gate (models/style/README.md, "Gate"): LiveStride,
// LiveGait and PoseSpeed. Each is the state of one stream. RT-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "models/motion/pose_space.hpp"
#include "models/style/live/trained_motion.hpp"

namespace posed::style {

// How fast the pose changes. Some part of a walker always moves, also while the legs turn back, so
// this shows a resting pose earlier than the legs do.
class PoseSpeed {
 public:
  // The pose `dt_s` after the last one. `known` says what a distance between poses is.
  void update(const TrainedMotion& known, std::span<const float> q,
              std::span<const std::uint8_t> available, double dt_s) noexcept;

  // The speed over about the last 40 ms [deg/s], rms over joints; NaN until two poses are known.
  [[nodiscard]] double value_deg_s() const noexcept { return speed_deg_s_; }

 private:
  std::array<float, motion::kMaxPoseDims> last_{};  // where a dimension was last there
  std::size_t dims_ = 0;                            // of the last pose; 0: there was none
  double speed_deg_s_ = std::numeric_limits<double>::quiet_NaN();
};

// Whether legs that stride walk or run. A walking body is an inverted
// pendulum, highest where the legs pass each other; a running one is a spring, lowest there (G. A.
// Cavagna, N. C. Heglund, C. R. Taylor, "Mechanical work in terrestrial locomotion", American
// Journal of Physiology 233, 1977). So the correlation of the pelvis' height with how far the legs
// are apart separates the two, whatever the cadence, the scale and the style.
class LiveGait {
 public:
  // The height of the pelvis and the leg signal (motion::LegSignal), `dt_s` after the last ones.
  void update(double height_m, double leg_rad, double dt_s) noexcept;

  // The correlation over about the last 0.3 s: towards -1 in a walk, towards 1 in a run. NaN until
  // 0.4 s are known, and where the pelvis keeps its height or the legs do not move.
  [[nodiscard]] double correlation() const noexcept;

  // How far the pelvis goes up and down about its mean [m]: the amplitude of a sine with its
  // variance. 0 until 0.4 s are known.
  [[nodiscard]] double bounce_m() const noexcept;

  // Starts anew: correlation() is unknown until 0.4 s from now.
  void forget() noexcept { seen_s_ = 0.0; }

 private:
  double seen_s_ = 0.0;
  double height_m_ = 0.0, apart_rad_ = 0.0;                           // means
  double height_m2_ = 0.0, apart_rad2_ = 0.0, together_m_rad_ = 0.0;  // variances, covariance
};

// How far the legs swing and how fast they stride. The leg signal and its speed go round an ellipse
// once a stride; both figures describe that motion, so that they are known after a fraction of a
// stride.
class LiveStride {
 public:
  // The leg signal [rad] `dt_s` after the last one. `cadence_rad_s`, the walker's or else a usual
  // one, brings the speed to the scale of the signal.
  void update(double leg_rad, double dt_s, double cadence_rad_s) noexcept;

  // Half the distance between the extremes of the swing [rad]; 0 where the legs rest, in any pose.
  [[nodiscard]] double swing_rad() const noexcept;

  // The cadence over about the last half second [rad/s]; NaN until 0.3 s are known.
  [[nodiscard]] double cadence_rad_s() const noexcept;

  // Where in the stride the legs are, unwrapped: 0 where the right thigh is farthest in front. It
  // lags by the low-pass and goes round unevenly.
  [[nodiscard]] double angle_rad() const noexcept { return angle_rad_; }

  // Starts the cadence anew: cadence_rad_s() is unknown until 0.3 s from now.
  void forget_cadence() noexcept { turns_ = 0; }
  // From the next value on time runs the other way. Legs that turn round with it are slow for twice
  // as long as those that walk, and must not seem to rest.
  void turn_back() noexcept;

 private:
  struct Turn {
    double time_s, angle_rad;
  };
  static constexpr std::size_t kParts = 8;  // of the longest window that the largest speed is of
  static constexpr std::size_t kTurns = 9;  // angles that are kept

  [[nodiscard]] double fastest_rad() const noexcept;  // in the window
  void keep_speed(double before_s) noexcept;
  void keep_turn(double before_s) noexcept;

  bool started_ = false;
  double leg_rad_ = 0.0;                      // the signal
  double level_rad_ = 0.0;                    // smoothed
  double speed_rad_ = 0.0;                    // its speed over the cadence
  std::array<double, kParts> fastest_rad_{};  // of each part, the newest first
  std::size_t parts_ = kParts;                // those of the window
  double time_s_ = 0.0, angle_rad_ = 0.0;
  std::array<Turn, kTurns> turn_{};  // turn_[turns_ % kTurns] is the oldest or not there yet
  std::size_t turns_ = 0;
};

}  // namespace posed::style
