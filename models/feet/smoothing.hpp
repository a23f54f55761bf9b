// How a value follows another one, and how an offset returns to nothing. RT-safe.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace posed::feet {

// The share of the way to a new value that a low-pass of `tau_s` goes in `dt_s`.
[[nodiscard]] inline double smoothing(double dt_s, double tau_s) noexcept {
  return -std::expm1(-dt_s / tau_s);
}

// `v` on its way to 0: by a share of itself, exp(-share), and by `constant`, so that it arrives.
[[nodiscard]] inline Eigen::Vector3d approached(const Eigen::Vector3d& v, double share,
                                                double constant) noexcept {
  const double length = v.norm();
  if (length == 0.0) return v;
  return v * (std::max(0.0, length * std::exp(-share) - constant) / length);
}

}  // namespace posed::feet
