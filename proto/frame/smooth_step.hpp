#pragma once

#include <algorithm>

#include "proto/frame/rt_safe.hpp"

namespace posed {

// Rises from 0 to 1 while x goes from 0 to 1, without a jump of the slope. Real-time safe.
RT_SAFE [[nodiscard]] inline double smooth_step(double x) noexcept {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

}  // namespace posed
