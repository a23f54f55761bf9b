// SenderClock: the device time from /VMC/Ext/T, the sender's time in seconds as a 32-bit float.
// Such a float has steps of 0.5 ms after one hour, 2 ms after five and 4 ms after ten. From
// kFinest_s on (18 hours; some senders send the time of day) it is not used as a clock.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "proto/frame/sink.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::vmc {

// RT-safe.
class SenderClock {
 public:
  // kLate: a newer time came before it, so the datagram was overtaken by another. kOutOfRange: no
  // time. kOk: taken, or too coarse to be used.
  [[nodiscard]] Outcome accept(float time_s) noexcept {
    if (!std::isfinite(time_s) || time_s < 0.0F) return Outcome::kOutOfRange;
    if (time_s >= kFinest_s) {
      // One such value may be damaged; many are a sender that has no usable clock.
      if (coarse_ < kMaxCoarse) ++coarse_;
      if (coarse_ == kMaxCoarse) seen_ = false;
      return Outcome::kOk;
    }
    coarse_ = 0;
    const double step_s = static_cast<double>(time_s) - static_cast<double>(newest_s_);
    const bool late = seen_ && step_s < 0.0 && step_s > -kLate_s;
    late_ = late ? late_ + 1 : 0;
    if (late && late_ < kMaxLate) return Outcome::kLate;
    // A larger step back is a sender that started again: time continues from where it was.
    if (seen_ && step_s > 0.0) ticks_ns_ = std::min(ticks_ns_ + nanoseconds(step_s), kLast_ns);
    seen_ = true;
    late_ = 0;
    newest_s_ = time_s;
    return Outcome::kOk;
  }

  // Since the first time; kNoTime_ns when there is none. Never decreases while it is there.
  [[nodiscard]] std::int64_t device_ns() const noexcept { return seen_ ? ticks_ns_ : kNoTime_ns; }

 private:
  static constexpr float kFinest_s = 65536.0F;
  static constexpr std::int64_t kLast_ns = INT64_MAX / 2;
  static constexpr double kLate_s = 0.1;  // no network holds a datagram back for longer
  static constexpr int kMaxLate = 8;      // in a row; then the sender's time has gone back
  static constexpr int kMaxCoarse = 8;    // in a row

  float newest_s_ = 0.0F;
  std::int64_t ticks_ns_ = 0;
  bool seen_ = false;
  int late_ = 0;
  int coarse_ = 0;
};

}  // namespace posed::drivers::vmc
