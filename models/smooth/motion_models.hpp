// MotionModels: a small bank of Kalman filters with fixed assumptions on how a joint moves, beside
// the window's solve (models/smooth/README.md, "Bank of motion models"). The window expects what
// hands do. A motion that does something else, such as a sine or a sensor that jumps, is followed
// better by one of these; which one is learnt for each channel from how well each would have
// predicted a measurement that it had not seen.
//
// Units: radians and seconds. All memory is allocated at construction; the rest is RT-safe. One
// thread.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "models/smooth/live_options.hpp"

namespace posed::smooth {

class MotionModels {
 public:
  explicit MotionModels(int channels);

  // The next frame: [channels] rad, NaN where missing, `step_s` after the one before.
  // A channel's own noise is `share` of noise_rad.
  void push(double step_s, std::span<const double> measured_rad, double noise_rad,
            std::span<const double> share = {}) noexcept;

  // Judges the bank and the window by the frame before the newest, as both estimate it now:
  // `window_rad` and its variance, [channels]. Needs two pushes since reset().
  void judge(const double* window_rad, const double* window_rad2) noexcept;

  // What all know together of a channel `back` frames before the newest, 0 to kMaxLagFrames;
  // `window_rad` is the window's estimate of it. The window's own where the channel was missing
  // within the last second.
  [[nodiscard]] double mixed(int channel, int back, double window_rad) const noexcept;

  void reset() noexcept;

 private:
  static constexpr int kModels = 7;
  static constexpr int kPositions = kMaxLagFrames + 1;

  // What a model knows how well, the same for all channels.
  struct Spread {
    std::array<std::array<double, 3>, 3> state{};          // covariance of position, speed, ...
    std::array<std::array<double, 3>, kPositions> past{};  // of a past position with the state
    std::array<double, kPositions> variance{};             // of a past position

    void start(double variance_rad2) noexcept;
    void predict(double step_s, std::size_t model) noexcept;
    // Returns the gains: of the state, then of the past positions.
    std::array<double, 3 + kPositions> update(double variance_rad2) noexcept;
  };

  void restart(std::size_t channel, double value_rad) noexcept;
  void weigh(std::size_t channel, const std::array<double, kModels + 1>& hand) noexcept;

  struct Channel {
    std::array<std::array<double, kPositions>, kModels> position{};  // newest first [rad]
    std::array<std::array<double, 2>, kModels> motion{};             // rad/s, rad/s^2
    std::array<double, kModels + 1> error2{};  // mean square over that of the noise; window's last
    std::array<double, kModels + 1> weight{};
    double before_rad = 0.0, now_rad = 0.0;  // measured
    double share = 1.0, share_before = 1.0;  // of the noise, at these
    double known_s = 0.0;                    // measured without a gap
  };

  std::vector<Channel> channels_;
  std::array<Spread, kModels> spread_{};
  double noise_rad2_ = 0.0, noise_before_rad2_ = 0.0;
  double step_s_ = 0.0;
  long pushed_ = 0;
};

}  // namespace posed::smooth
