// ActiveTime: the arrival time without the pauses of the sender. A decoder that forgets what has
// not come for a while measures by it, so that a silent network or a paused system ends nothing.
#pragma once

#include <algorithm>
#include <cstdint>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {

class ActiveTime {
 public:
  // Call it for every datagram. Begins with the first arrival and never decreases.
  RT_SAFE [[nodiscard]] std::int64_t to(std::int64_t arrival_ns) noexcept {
    if (last_ns_ == kNoTime_ns) {
      now_ns_ = arrival_ns;
    } else {
      now_ns_ += std::clamp<std::int64_t>(arrival_ns - last_ns_, 0, kMaxTime_ns);
    }
    last_ns_ = arrival_ns;
    return now_ns_;
  }

 private:
  // A longer pause counts as one of this length: the longest time between two datagrams of a system
  // that is not paused.
  static constexpr std::int64_t kMaxTime_ns = kNanosPerSecond / 2;

  std::int64_t last_ns_ = kNoTime_ns;
  std::int64_t now_ns_ = kNoTime_ns;
};

}  // namespace posed::drivers
