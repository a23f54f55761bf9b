// How an offset returns to nothing. RT-safe.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace posed::feet {

// `v` on its way to 0: by a share of itself, exp(-share), and by `constant`, so that it arrives.
[[nodiscard]] inline Eigen::Vector3d approached(const Eigen::Vector3d& v, double share,
                                                double constant) noexcept {
  const double length = v.norm();
  if (length == 0.0) return v;
  return v * (std::max(0.0, length * std::exp(-share) - constant) / length);
}

}  // namespace posed::feet
