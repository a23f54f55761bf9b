// TimeCode: a character's device time from the time codes of its datagrams [ms]. RT-safe.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "drivers/unrolled_counter.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::mvn {

class TimeCode {
 public:
  [[nodiscard]] bool has_begun() const noexcept { return begun_; }

  // The first time code. Characters of one MVN share its clock: `other`, when it has one, says
  // which time belongs to a time code near this one.
  void begin(std::uint32_t code_ms, const TimeCode* other) noexcept {
    *this = TimeCode();
    begun_ = true;
    newest_ms_ = code_ms;
    static_cast<void>(counter_.to(code_ms));
    if (other == nullptr) return;
    const auto apart_ms = static_cast<std::int32_t>(code_ms - other->newest_ms_);
    const bool same_clock = std::abs(std::int64_t{apart_ms}) < kNear_ms;
    time_ms_ = other->time_ms_ + (same_clock ? apart_ms : 0);
    moves_ = same_clock && other->moves_;
  }

  // Never decreases. kNoTime_ns until the time code has changed: without a recording MVN's clock
  // may stand.
  [[nodiscard]] std::int64_t to_ns(std::uint32_t code_ms) noexcept {
    const std::uint32_t behind_ms = newest_ms_ - code_ms;
    // A datagram of another type that came late does not set the clock back.
    if (behind_ms >= kNear_ms) {
      const std::int64_t before_ms = ticks_ms_;
      ticks_ms_ = counter_.to(code_ms).ticks;
      const std::int64_t step_ms = ticks_ms_ - before_ms;
      // A longer step is none: MVN has restarted, or the value is damaged.
      if (step_ms <= kMaxGap_ms) time_ms_ = std::min(time_ms_ + step_ms, kLast_ms);
      newest_ms_ = code_ms;
      moves_ = true;
    }
    return moves_ ? time_ms_ * 1'000'000 : kNoTime_ns;
  }

 private:
  static constexpr std::uint32_t kNear_ms = 1000;
  static constexpr std::int64_t kMaxGap_ms = 3'600'000;
  static constexpr std::int64_t kLast_ms = INT64_MAX / 2 / 1'000'000;

  UnrolledCounter counter_{32};
  std::uint32_t newest_ms_ = 0;
  std::int64_t ticks_ms_ = 0;
  std::int64_t time_ms_ = 0;
  bool begun_ = false;
  bool moves_ = false;
};

}  // namespace posed::drivers::mvn
