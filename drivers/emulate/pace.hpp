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

}  // namespace posed::drivers::emulate
