// Baselines: filters in common use for hand tracking. Each is tuned on the very data on which it is
// evaluated, so the live smoother is compared with their best possible result. Cold; for the
// benchmark and tests.
//
// Motions are [frames x channels] in degrees, without missing values and evenly spaced. Row t of a
// result is the estimate of frame t from measurements up to t + lag; rows without an estimate hold
// the measured value.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "proto/clip/clip.hpp"

namespace posed::bench {

// A hand's true motion and what the sensors measured.
struct Trial {
  clip::ChannelMatrix truth, measured;
  double rate_hz = 60.0;
};

// Rms error [deg] without the first 40 and the last 8 frames.
[[nodiscard]] double rms_deg(const clip::ChannelMatrix& estimate, const clip::ChannelMatrix& truth);

// The value, `lag` frames before the newest, of the polynomial that fits `window` frames best;
// order 0 is the moving average.
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
  double rms_deg = 0.0;  // over the trials, with equal weights
};

// Moving average, local polynomial, One-Euro, constant-velocity Kalman: the best setting of each
// from a grid, on these trials. Takes seconds.
[[nodiscard]] std::vector<Tuned> tuned_baselines(std::span<const Trial> trials, int lag,
                                                 double noise_deg);

}  // namespace posed::bench
