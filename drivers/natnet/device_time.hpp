// DeviceTime: the time of a frame on the server's own clock. It never decreases.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "drivers/natnet/frame.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::natnet {

// From 3.0 the middle of the camera's exposure in ticks, if the server has said how many a second
// it counts; otherwise the timestamp. RT-safe.
class DeviceTime {
 public:
  [[nodiscard]] std::int64_t of(const FrameView& frame, std::uint64_t clock_hz) noexcept {
    const bool ticks = frame.exposure_ticks != 0 && clock_hz != 0 && clock_hz <= kMaxClock_hz;
    return ticks ? to(nanoseconds_of(frame.exposure_ticks, clock_hz), clock_hz)
                 : to(nanoseconds_of(frame.timestamp_s), 0);
  }

 private:
  static constexpr std::uint64_t kMaxClock_hz = 4'000'000'000;  // the product below fits 64 bits
  static constexpr std::uint64_t kMaxSeconds = 4'000'000'000;   // 126 years
  // A longer step is none: the server has restarted, or the value is damaged.
  static constexpr std::int64_t kMaxStep_ns = 3600 * kNanosPerSecond;
  static constexpr std::int64_t kLast_ns = INT64_MAX / 2;

  static std::int64_t nanoseconds_of(std::uint64_t ticks, std::uint64_t clock_hz) noexcept {
    const std::uint64_t whole_s = ticks / clock_hz;
    if (whole_s > kMaxSeconds) return kNoTime_ns;
    const std::uint64_t rest_ns = ticks % clock_hz * kNanosPerSecond / clock_hz;
    return static_cast<std::int64_t>(whole_s * kNanosPerSecond + rest_ns);
  }
  static std::int64_t nanoseconds_of(double time_s) noexcept {
    if (!(std::abs(time_s) <= static_cast<double>(kMaxSeconds))) return kNoTime_ns;  // or NaN
    return nanoseconds(time_s);
  }

  // A clock whose origin changes (`base`) goes on from where it was.
  std::int64_t to(std::int64_t device_ns, std::uint64_t base) noexcept {
    if (device_ns == kNoTime_ns) return now_ns_;
    if (now_ns_ == kNoTime_ns) {
      now_ns_ = device_ns;
    } else if (base == base_) {
      const std::int64_t step_ns = device_ns - last_ns_;
      const bool valid = step_ns > 0 && step_ns <= kMaxStep_ns;
      if (valid) now_ns_ = std::min(now_ns_ + step_ns, kLast_ns);
    }
    base_ = base;
    last_ns_ = device_ns;
    return now_ns_;
  }

  std::int64_t now_ns_ = kNoTime_ns;
  std::int64_t last_ns_ = 0;  // as the server counts
  std::uint64_t base_ = 0;    // its clock [Hz]; 0: the timestamp
};

}  // namespace posed::drivers::natnet
