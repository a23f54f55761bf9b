#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <ranges>

#include "proto/frame/rt_safe.hpp"

namespace posed {

// The value above a share of the others, from 0 to below 1, of at least one value. The range is
// reordered. Real-time safe.
template <std::ranges::random_access_range Range>
RT_SAFE [[nodiscard]] auto quantile(Range&& values, double share) noexcept {
  const auto size = std::ranges::ssize(values);
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(size));
  assert(place >= 0 && place < size);
  const auto at = std::ranges::begin(values) + place;
  std::ranges::nth_element(values, at);
  return *at;
}

// The median; of an even count the upper of the two in the middle.
template <std::ranges::random_access_range Range>
RT_SAFE [[nodiscard]] auto median(Range&& values) noexcept {
  return quantile(values, 0.5);
}

}  // namespace posed
