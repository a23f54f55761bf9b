// Elapsed: how long ago the last frame of a stream was, by the frames themselves. Stages know no
// clock. RT-safe.
#pragma once

#include <cstdint>
#include <utility>

#include "proto/frame/frame.hpp"

namespace posed {

class Elapsed {
 public:
  // Time since the frame before [s], by the device's clock where there is one. 0 for the first
  // frame, for a step back in time and where neither frame has a time.
  double next_s(const Header& header) noexcept {
    const std::int64_t now_ns =
        header.device_ns != kNoTime_ns ? header.device_ns : header.arrival_ns;
    const std::int64_t before_ns = std::exchange(last_ns_, now_ns);
    if (before_ns == kNoTime_ns || now_ns == kNoTime_ns || now_ns <= before_ns) return 0.0;
    // Unsigned: the difference of two times may exceed the signed range.
    const auto gap_ns = static_cast<std::uint64_t>(now_ns) - static_cast<std::uint64_t>(before_ns);
    return static_cast<double>(gap_ns) * 1e-9;
  }

 private:
  std::int64_t last_ns_ = kNoTime_ns;
};

}  // namespace posed
