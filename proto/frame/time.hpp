// Time in posed: signed nanoseconds. Host times are CLOCK_MONOTONIC; device times count from the
// device's own origin. Nothing below daemon/ reads a clock: the caller passes the time in.
#pragma once

#include <cstdint>
#include <limits>

namespace posed {

inline constexpr std::int64_t kNoTime_ns = std::numeric_limits<std::int64_t>::min();
inline constexpr std::int64_t kNanosPerSecond = 1'000'000'000;

[[nodiscard]] constexpr double seconds(std::int64_t duration_ns) noexcept {
  return static_cast<double>(duration_ns) * 1e-9;
}
[[nodiscard]] constexpr std::int64_t nanoseconds(double duration_s) noexcept {
  return static_cast<std::int64_t>(duration_s * 1e9 + (duration_s < 0 ? -0.5 : 0.5));
}

// A clock is a plain function, so that tests and replay can supply their own.
using Clock = std::int64_t (*)() noexcept;

// host_ns = device_ns + offset_ns + drift_ppm * 1e-6 * (device_ns - origin_ns)
struct ClockMapping {
  std::int64_t offset_ns = 0;
  std::int64_t origin_ns = 0;
  float drift_ppm = 0.0F;
  bool valid = false;
};

}  // namespace posed
