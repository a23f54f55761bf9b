// UnrolledCounter: turns a device's counter of few bits into a time that does not wrap.
#pragma once

#include <cstdint>

#include "proto/frame/rt_safe.hpp"

namespace posed::drivers {

// Counts modulo 2^bits. A step of less than half the range is forward; a larger step means that the
// device's counter ran backwards (it restarted): time continues from where it was, and `restarted`
// is set.
class UnrolledCounter {
 public:
  explicit UnrolledCounter(int bits) noexcept : mask_((std::uint64_t{1} << bits) - 1) {}

  struct Step {
    std::int64_t ticks;  // since the first count; never decreases
    bool restarted;
  };

  RT_SAFE Step to(std::uint64_t count) noexcept {
    count &= mask_;
    if (!seen_) {
      seen_ = true;
      last_ = count;
      return {ticks_, false};
    }
    const std::uint64_t step = (count - last_) & mask_;
    last_ = count;
    if (step > mask_ / 2) return {ticks_, true};
    ticks_ += static_cast<std::int64_t>(step);
    return {ticks_, false};
  }

 private:
  std::uint64_t mask_;
  std::uint64_t last_ = 0;
  std::int64_t ticks_ = 0;
  bool seen_ = false;
};

}  // namespace posed::drivers
