#pragma once

#include <algorithm>
#include <cassert>
#include <ranges>

#include "proto/frame/rt_safe.hpp"

namespace posed {

// The median of at least one value; of an even count the upper of the two in the middle. The range
// is reordered. Real-time safe.
template <std::ranges::random_access_range Range>
RT_SAFE [[nodiscard]] auto median(Range&& values) noexcept {
  assert(!std::ranges::empty(values));
  const auto middle = std::ranges::begin(values) + std::ranges::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace posed
