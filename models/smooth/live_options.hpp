// Options of the live smoother: how far the output lags behind the hand, and the assumed sensor
// noise.
#pragma once

#include <string_view>

#include "proto/frame/result.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::smooth {

// A lag in frames of the stream, or in time when `seconds` is above zero: then the nearest number
// of frames at the stream's own rate. Bounds: 0 to 5 frames up to 60 Hz, up to 170 ms above. A
// larger lag is reduced to the bound, and published frames state the lag in use.
struct LiveLag {
  int frames = 1;
  double seconds = 0.0;
};

inline constexpr int kMaxLagFrames = 5;
inline constexpr double kMaxLag_s = 0.170;
inline constexpr double kEvenRate_hz =
    60.0;  // up to this rate the bound is in frames, above it in time

// Frames of lag at a rate, within the bounds.
RT_SAFE [[nodiscard]] int lag_frames(const LiveLag& lag, double period_s) noexcept;

// Parses "1" (frames, at most as many as 170 ms can hold) or "33ms". Errors state what is allowed.
Result<LiveLag> parse_lag(std::string_view text);

struct LiveOptions {
  LiveLag lag;
  // Standard deviation of a channel's sensor noise [rad]; 0: estimated from the stream itself.
  double noise_rad = 0.0;
  // How far off the device's angles are while the hand is held, beside their noise: the standard
  // deviation of an angle [rad]. Only the recogniser makes allowance for it.
  double error_rad = 0.0;
};

}  // namespace posed::smooth
