// ShedRanges: the frames (or samples) of a stream that were decoded in the live run but never
// reached its engine. Cold.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace posed::replay {

class ShedRanges {
 public:
  // first + count must not overflow.
  void add(std::uint64_t first, std::uint64_t count) { ranges_.push_back({first, first + count}); }

  // Call after the last add(): joins overlapping ranges, so that contains() can use a binary
  // search.
  void finish() {
    std::ranges::sort(ranges_, {}, &Range::first);
    std::vector<Range> joined;
    for (const Range& range : ranges_) {
      if (joined.empty() || joined.back().end < range.first) {
        joined.push_back(range);
      } else {
        joined.back().end = std::max(joined.back().end, range.end);
      }
    }
    ranges_ = std::move(joined);
  }

  [[nodiscard]] bool contains(std::uint64_t sequence) const {
    const auto after = std::ranges::upper_bound(ranges_, sequence, {}, &Range::first);
    return after != ranges_.begin() && sequence < (after - 1)->end;
  }

 private:
  struct Range {
    std::uint64_t first = 0;
    std::uint64_t end = 0;  // the first that is not shed
  };
  std::vector<Range> ranges_;  // after finish() sorted and without overlap
};

}  // namespace posed::replay
