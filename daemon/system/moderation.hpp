// Moderation: a thread that handles thousands of elements a second rests after each turn, so that
// what comes meanwhile is handled in one turn, by this thread and by those behind it: most of the
// CPU time of many streams is wake-ups. Network cards moderate their interrupts in the same way.
// Below kBusy_hz nothing rests, so latency is added only where there is load. RT-safe.
#pragma once

#include <cstdint>

#include "proto/frame/time.hpp"

namespace posed::system {

class Moderation {
 public:
  static constexpr std::int64_t kBusy_hz = 6000;  // 50 streams at 120 Hz
  static constexpr std::int64_t kRest_ns = 200'000;
  static constexpr std::int64_t kWindow_ns = 16'000'000;

  // Returns how long to rest after this turn. `handled` counts the elements since the start for
  // which no other thread waits.
  [[nodiscard]] std::int64_t rest_ns(std::uint64_t handled, std::int64_t now_ns) noexcept {
    const std::int64_t window_ns = now_ns - begin_ns_;
    if (window_ns >= kWindow_ns) {
      const auto count = static_cast<std::int64_t>(handled - handled_before_);
      const std::int64_t rate_hz = count * kNanosPerSecond / window_ns;
      rest_ns_ = rate_hz <= kBusy_hz ? 0 : kRest_ns;
      begin_ns_ = now_ns;
      handled_before_ = handled;
    }
    return rest_ns_;
  }

 private:
  std::int64_t begin_ns_ = 0;
  std::uint64_t handled_before_ = 0;
  std::int64_t rest_ns_ = 0;
};

}  // namespace posed::system
