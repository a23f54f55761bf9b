// Pace: the time at which an emulated device's next record is due. The schedule is absolute, so
// late calls do not add up. Records missed during a long pause are skipped, as on a real device.
#pragma once

#include <cstdint>

#include "proto/frame/time.hpp"

namespace posed::drivers::emulate {

class Pace {
 public:
  explicit Pace(std::int64_t period_ns) noexcept : period_ns_(period_ns) {}

  [[nodiscard]] std::int64_t due_ns() const noexcept { return due_ns_; }
  [[nodiscard]] bool running() const noexcept { return due_ns_ != kNoTime_ns; }

  void start(std::int64_t now_ns) noexcept { due_ns_ = now_ns; }
  void stop() noexcept { due_ns_ = kNoTime_ns; }

  // Call it when the due record was sent.
  void step(std::int64_t now_ns) noexcept {
    constexpr std::int64_t kMaxLate = 10;  // periods
    const bool paused = now_ns - due_ns_ > kMaxLate * period_ns_;
    due_ns_ = (paused ? now_ns : due_ns_) + period_ns_;
  }

 private:
  std::int64_t period_ns_;
  std::int64_t due_ns_ = kNoTime_ns;
};

// The timecode that emulated devices send.

// The timecode of a generator of 30 frames per second that shows one hour at the start: hours,
// minutes, seconds and frames, the hours in the highest byte.
[[nodiscard]] constexpr std::uint32_t timecode_at(std::int64_t time_ns) noexcept {
  const auto frames = static_cast<std::uint32_t>(time_ns / (kNanosPerSecond / 30));
  const std::uint32_t all_seconds = frames / 30;
  const std::uint32_t hours = 1 + all_seconds / 3600;
  return (hours % 24) << 24 | (all_seconds / 60 % 60) << 16 | (all_seconds % 60) << 8 | frames % 30;
}

}  // namespace posed::drivers::emulate
