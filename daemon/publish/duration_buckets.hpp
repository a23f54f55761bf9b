// DurationBuckets: how many durations since the start took at most so long, in fixed memory. What
// Prometheus calls a histogram: its counts only grow, and its bounds never change.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "daemon/pipeline/counters.hpp"

namespace posed::publish {

class DurationBuckets {
 public:
  // From a fast stage to a second; closer around the usual frame periods (8.3, 10, 16.7, 33.3 ms).
  static constexpr std::array<std::int64_t, 19> kBounds_ns{
      5'000,      10'000,     20'000,      50'000,      100'000,      200'000,    500'000,
      1'000'000,  2'000'000,  4'000'000,   8'000'000,   12'000'000,   17'000'000, 25'000'000,
      34'000'000, 50'000'000, 100'000'000, 250'000'000, 1'000'000'000};

  struct Counts {
    // By bound, those that exceed the one before and not this one; the last exceed all bounds.
    std::array<std::uint64_t, kBounds_ns.size() + 1> count{};
    std::uint64_t sum_ns = 0;
  };

  // Only one thread. Negative durations count as 0.
  RT_SAFE void add(std::int64_t duration_ns) noexcept {
    const std::int64_t value = std::max<std::int64_t>(duration_ns, 0);
    std::size_t bucket = 0;
    for (const std::int64_t bound : kBounds_ns) bucket += value > bound ? 1 : 0;
    pipeline::count(count_[bucket]);
    pipeline::count(sum_ns_, static_cast<std::uint64_t>(value));
  }

  // Any thread.
  [[nodiscard]] Counts counts() const noexcept {
    Counts now;
    for (std::size_t i = 0; i < count_.size(); ++i) now.count[i] = count_[i].load();
    now.sum_ns = sum_ns_.load();
    return now;
  }

 private:
  std::array<std::atomic<std::uint64_t>, kBounds_ns.size() + 1> count_{};
  std::atomic<std::uint64_t> sum_ns_{0};
};

}  // namespace posed::publish
