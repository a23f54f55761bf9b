// LatencyHistogram: percentiles of durations in fixed memory. Each bucket is an eighth of an octave
// wide, so a percentile is at most 9 % too high; the maximum is exact.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "proto/frame/rt_safe.hpp"

namespace posed::publish {

class LatencyHistogram {
 public:
  // Negative durations count as 0.
  RT_SAFE void add(std::int64_t duration_ns) noexcept {
    const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(duration_ns, 0));
    ++buckets_[bucket(value)];
    ++count_;
    max_ns_ = std::max(max_ns_, value);
  }

  // The duration that the fraction `p` of all durations does not exceed [us]; 0 if there are none.
  [[nodiscard]] double percentile_us(double p) const noexcept {
    const auto wanted = static_cast<std::uint64_t>(p * static_cast<double>(count_));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      seen += buckets_[i];
      if (seen > wanted) return static_cast<double>(std::min(upper_ns(i), max_ns_)) * 1e-3;
    }
    return max_us();
  }
  [[nodiscard]] double max_us() const noexcept { return static_cast<double>(max_ns_) * 1e-3; }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

  void clear() noexcept { *this = {}; }

 private:
  // Values below 8 have a bucket each; above, each power of two has 8 buckets, chosen by the three
  // bits after the leading one.
  static constexpr std::size_t kBuckets = 8 + 61 * 8;
  [[nodiscard]] static std::size_t bucket(std::uint64_t value) noexcept {
    if (value < 8) return value;
    const int exponent =
        static_cast<int>(std::bit_width(value)) - 4;  // value >> exponent is in 8..15
    return static_cast<std::size_t>(exponent) * 8 + static_cast<std::size_t>(value >> exponent);
  }
  [[nodiscard]] static std::uint64_t upper_ns(std::size_t bucket) noexcept {
    if (bucket < 16) return bucket;
    const std::size_t exponent = bucket / 8 - 1;
    return ((std::uint64_t{bucket % 8 + 8} + 1) << exponent) - 1;
  }

  std::array<std::uint32_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  std::uint64_t max_ns_ = 0;
};

}  // namespace posed::publish
