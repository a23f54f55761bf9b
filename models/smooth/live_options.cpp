#include "models/smooth/live_options.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "proto/clip/text.hpp"

namespace posed::smooth {
namespace {

// A 60 Hz stream whose clock is slightly fast still counts as 60 Hz.
constexpr double kRateSlack = 1.02;

std::unexpected<Error> bad_lag(std::string_view text) {
  return misuse("'" + std::string(text) +
                "' is no lag: give frames, as in 1 (up to 5, and up to 170 ms above 60 Hz), or "
                "milliseconds, as in 33ms (up to 170)");
}

}  // namespace

RT_SAFE int lag_frames(const LiveLag& lag, double period_s) noexcept {
  if (period_s <= 0.0) period_s = 1.0 / kEvenRate_hz;  // the period is not known yet
  const bool even = period_s * kEvenRate_hz * kRateSlack >= 1.0;
  const int most = even ? kMaxLagFrames : static_cast<int>(kMaxLag_s / period_s + 1e-6);
  const double wanted = lag.seconds > 0.0 ? std::round(lag.seconds / period_s) : lag.frames;
  return static_cast<int>(std::clamp(wanted, 0.0, static_cast<double>(most)));
}

Result<LiveLag> parse_lag(std::string_view text) {
  std::string_view digits = clip::trim(text);
  const bool in_ms = digits.ends_with("ms");
  if (in_ms) digits.remove_suffix(2);
  const auto value = clip::parse_number(clip::trim(digits));
  if (!value || *value < 0.0) return bad_lag(text);
  LiveLag lag;
  if (in_ms) {
    if (*value > kMaxLag_s * 1e3) return bad_lag(text);
    lag.frames = 0;  // "0ms" means no lag
    lag.seconds = *value * 1e-3;
    return lag;
  }
  if (*value != std::floor(*value) || *value > kMaxLag_s * 1e3) return bad_lag(text);
  lag.frames = static_cast<int>(*value);
  return lag;
}

}  // namespace posed::smooth
