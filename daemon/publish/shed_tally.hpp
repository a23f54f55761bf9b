// ShedTally: when to tell that frames of a stream were skipped. A machine that cannot keep up skips
// some with every frame it keeps; a line for each would only slow it further. The first is told at
// once, then a sum at most once a second; nothing skipped is ever left out of the sums.
#pragma once

#include <cstdint>
#include <optional>

#include "proto/frame/time.hpp"

namespace posed::publish {

class ShedTally {
 public:
  struct Sum {
    std::uint64_t frames = 0;
    std::uint64_t first = 0, last = 0;  // sequences; between them other frames may have gone out
  };

  // `frames` from `first` on were skipped.
  void add(std::uint64_t first, std::uint64_t frames) noexcept {
    if (frames == 0) return;
    if (unreported_.frames == 0) unreported_.first = first;
    unreported_.frames += frames;
    unreported_.last = first + frames - 1;
  }

  // What is to be told now. At the end of a stream everything is.
  [[nodiscard]] std::optional<Sum> take(std::int64_t now_ns, bool at_end = false) noexcept {
    const bool reported_lately =
        reported_ns_ != kNoTime_ns && now_ns - reported_ns_ < kNanosPerSecond;
    if (unreported_.frames == 0 || (reported_lately && !at_end)) return std::nullopt;
    reported_ns_ = now_ns;
    const Sum sum = unreported_;
    unreported_ = {};
    return sum;
  }

 private:
  Sum unreported_;
  std::int64_t reported_ns_ = kNoTime_ns;
};

}  // namespace posed::publish
