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
    if (untold_.frames == 0) untold_.first = first;
    untold_.frames += frames;
    untold_.last = first + frames - 1;
  }

  // What is to be told now. At the end of a stream everything is.
  [[nodiscard]] std::optional<Sum> take(std::int64_t now_ns, bool at_end = false) noexcept {
    const bool told_lately = told_ns_ != kNoTime_ns && now_ns - told_ns_ < kNanosPerSecond;
    if (untold_.frames == 0 || (told_lately && !at_end)) return std::nullopt;
    told_ns_ = now_ns;
    const Sum sum = untold_;
    untold_ = {};
    return sum;
  }

 private:
  Sum untold_;
  std::int64_t told_ns_ = kNoTime_ns;
};

}  // namespace posed::publish
