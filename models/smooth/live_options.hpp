// What the operator chooses of the live generator: how far the output runs behind the hand, and how
// much the sensors are trusted.
#pragma once

#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::smooth {

// A lag in frames of the stream, or in time when `seconds` is above zero: then as many frames as
// come nearest at the stream's own rate. 0 to 5 frames up to 60 Hz, up to 170 ms above; a stream
// that is asked for more gets the bound, and the wire tells what it got.
struct LiveLag {
  int frames = 1;
  double seconds = 0.0;
};

inline constexpr int kMaxLagFrames = 5;
inline constexpr double kMaxLag_s = 0.170;
inline constexpr double kEvenRate_hz = 60.0;  // up to here bounds count frames, above time

// Frames of lag at a rate, within the bounds. RT-safe.
[[nodiscard]] int lag_frames(const LiveLag& lag, double period_s) noexcept;

// "1" (frames, as many as 170 ms can hold) or "33ms". Errors say what is allowed.
[[nodiscard]] Result<LiveLag> parse_lag(std::string_view text);

struct LiveOptions {
  LiveLag lag;
  // Standard deviation of a channel's sensor noise [rad]; 0: estimated from the stream itself.
  double noise_rad = 0.0;
};

}  // namespace posed::smooth
