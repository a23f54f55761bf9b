// Rivals: the filters that people use on a hand today, each tuned on the very data it is judged by,
// so that the live generator's figures stand beside the best they could be. Cold; for benches and
// tests.
//
// Motions are [frames x channels] in degrees, nothing missing; frames stand evenly. Row t of an
// answer is the estimate of frame t from what was measured up to t + lag; rows for which there is
// none hold the measured value.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "proto/clip/clip.hpp"

namespace posed::bench {

// A hand as it was and as the sensors saw it.
struct Trial {
  clip::ChannelMatrix truth, measured;
  double rate_hz = 60.0;
};

// Root of the mean square error, the first 40 and the last 8 frames left out. [deg]
[[nodiscard]] double rms_deg(const clip::ChannelMatrix& estimate, const clip::ChannelMatrix& truth);

// The value at `lag` frames before the newest of the polynomial that fits `window` frames best; of
// order 0 the moving average.
[[nodiscard]] clip::ChannelMatrix local_polynomial(const clip::ChannelMatrix& measured, int lag,
                                                   int window, int order);

struct OneEuro {
  double cutoff_hz = 1.0, beta = 0.0, speed_cutoff_hz = 1.0;  // beta [Hz s/deg]
};
[[nodiscard]] clip::ChannelMatrix one_euro(const clip::ChannelMatrix& measured, double rate_hz,
                                           const OneEuro& setting);

// Constant velocity with fixed-lag smoothing; q [deg^2] is the variance of a frame's acceleration.
[[nodiscard]] clip::ChannelMatrix kalman_velocity(const clip::ChannelMatrix& measured, int lag,
                                                  double q, double noise_deg);

struct Tuned {
  std::string name, setting;
  double rms_deg = 0.0;  // over the trials, each weighing the same
};

// Moving average, local polynomial, One-Euro, constant-velocity Kalman: the best of each over its
// grid on these trials. Seconds of work.
[[nodiscard]] std::vector<Tuned> tuned_baselines(std::span<const Trial> trials, int lag,
                                                 double noise_deg);

}  // namespace posed::bench
