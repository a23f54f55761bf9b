// StampClock: turns the glove's time stamps into an increasing time, even on a noisy line.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "proto/frame/rt_safe.hpp"

namespace posed::drivers::cyberglove {

// Counts modulo `range`. Stamps have no checksum, so a step of more than `plausible` counts (or
// backwards) is accepted only when the next stamp confirms it; until then time advances by one tick
// per stamp. A confirmed step forward (a pause) is taken in full; after a confirmed step backwards
// (a restart) time continues from where it was.
class StampClock {
 public:
  StampClock(std::int64_t range, std::int64_t plausible) noexcept
      : range_(range), plausible_(plausible) {}

  // Ticks since the first stamp; increases with every call.
  RT_SAFE std::int64_t to(std::int64_t count) noexcept {
    if (!last_) {
      last_ = count;
      return ticks_;
    }
    std::int64_t step = forward(*last_, count);
    if (step > plausible_) {
      const bool confirmed = doubted_ && forward(*doubted_, count) <= plausible_;
      if (!confirmed) {
        doubted_ = count;
        return ++ticks_;
      }
      if (step > range_ / 2) step = forward(*doubted_, count);
    }
    doubted_.reset();
    last_ = count;
    ticks_ = std::max(ticks_ + 1, known_ + step);
    known_ += step;
    return ticks_;
  }

 private:
  [[nodiscard]] std::int64_t forward(std::int64_t from, std::int64_t to) const noexcept {
    return (to - from + range_) % range_;
  }

  std::int64_t range_, plausible_;
  std::optional<std::int64_t> last_, doubted_;  // counts
  std::int64_t known_ = 0;                      // ticks at last_
  std::int64_t ticks_ = 0;                      // last value returned
};

}  // namespace posed::drivers::cyberglove
