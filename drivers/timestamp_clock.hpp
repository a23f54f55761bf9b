// TimestampClock: the order of frames and the device time, from a device's timestamps in seconds.
// They may jump: a recording that plays in a loop begins them again, a wall clock is set.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "proto/frame/sink.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {

class TimestampClock {
 public:
  // kDuplicate: the timestamp of the newest frame again. kLate: up to kLate_s before it. kOk: all
  // others; further back is a loop or a restart.
  RT_SAFE [[nodiscard]] Outcome accept(double timestamp_s) noexcept {
    if (!std::isfinite(timestamp_s)) return Outcome::kOk;  // it keeps the time of the one before
    const double step_s = timestamp_s - newest_s_;
    if (!seen_) {
      seen_ = true;
    } else if (step_s == 0.0) {
      // Many of them come from a system whose timestamp stands: it has no clock, but its frames are
      // new.
      if (same_in_a_row_ >= kMaxLate) return Outcome::kOk;
      ++same_in_a_row_;
      return Outcome::kDuplicate;
    } else if (step_s < 0.0 && step_s >= -kLate_s && ++late_in_a_row_ <= kMaxLate) {
      return Outcome::kLate;
    } else {
      const bool jump = step_s < 0.0 || step_s > kJump_s;  // then the period before counts
      if (!jump) period_ns_ = nanoseconds(step_s);
      elapsed_ns_ = std::min(elapsed_ns_ + period_ns_, kLast_ns);
    }
    newest_s_ = timestamp_s;
    late_in_a_row_ = 0;
    same_in_a_row_ = 0;
    return Outcome::kOk;
  }

  // Returns the time of the last accepted frame since the first one; it never decreases. kNoTime_ns
  // until one has a timestamp, and while the timestamp stands.
  RT_SAFE [[nodiscard]] std::int64_t device_ns() const noexcept {
    return seen_ && same_in_a_row_ < kMaxLate ? elapsed_ns_ : kNoTime_ns;
  }

 private:
  static constexpr double kLate_s = 0.25;   // further behind than a network delivers
  static constexpr double kJump_s = 600.0;  // somebody moved the playhead
  static constexpr int kMaxLate = 32;       // then it is a loop shorter than kLate_s
  static constexpr std::int64_t kLast_ns = INT64_MAX / 2;

  double newest_s_ = 0.0;
  std::int64_t period_ns_ = 0;
  std::int64_t elapsed_ns_ = 0;
  int late_in_a_row_ = 0;
  int same_in_a_row_ = 0;
  bool seen_ = false;
};

}  // namespace posed::drivers
