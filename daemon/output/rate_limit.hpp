// RateLimit: admits at most a given number of frames a second, evenly. A frame that comes a quarter
// of a period early is still admitted, so that a stream of exactly that rate loses none to jitter.
// Of frames that come together at most one is admitted; offer the newest.
#pragma once

#include <cstdint>

#include "proto/frame/time.hpp"

namespace posed::output {

class RateLimit {
 public:
  // With `rate_hz` 0 there is no limit.
  explicit RateLimit(double rate_hz) noexcept
      : period_ns_(rate_hz > 0.0 ? nanoseconds(1.0 / rate_hz) : 0) {}

  [[nodiscard]] bool limits() const noexcept { return period_ns_ > 0; }

  [[nodiscard]] bool admit(std::int64_t now_ns) noexcept {
    if (due_ns_ != kNoTime_ns && now_ns < due_ns_ - period_ns_ / 4) return false;
    // After a pause it begins anew, instead of making up for it.
    const bool goes_on = due_ns_ != kNoTime_ns && now_ns < due_ns_ + period_ns_;
    due_ns_ = (goes_on ? due_ns_ : now_ns) + period_ns_;
    return true;
  }

 private:
  std::int64_t period_ns_;
  std::int64_t due_ns_ = kNoTime_ns;  // when the next frame is due
};

}  // namespace posed::output
