// ShedTally decides when to report that frames of a stream were skipped. A machine that cannot keep
// up skips frames all the time, and a line for each would slow it down further. The first skip is
// reported at once, the following ones as a sum at most once a second; the sums include every
// skipped frame.
#pragma once

#include <cstdint>
#include <optional>

#include "proto/frame/time.hpp"

namespace posed::publish {

class ShedTally {
 public:
  struct Sum {
    std::uint64_t frames = 0;
    // sequences; some frames between them may have been published
    std::uint64_t first = 0, last = 0;
  };

  // The `frames` frames from sequence `first` on were skipped.
  void add(std::uint64_t first, std::uint64_t frames) noexcept {
    if (frames == 0) return;
    if (unreported_.frames == 0) unreported_.first = first;
    unreported_.frames += frames;
    unreported_.last = first + frames - 1;
  }

  // The sum to report now, if one is due. At the end of a stream the rest is always due.
  [[nodiscard]] std::optional<Sum> next_sum(std::int64_t now_ns, bool at_end = false) noexcept {
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
