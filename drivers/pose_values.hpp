// Checks of the positions and rotations that a device sends. All of them are RT-safe.
#pragma once

#include <cmath>

#include "proto/frame/frame.hpp"
#include "proto/frame/plausible.hpp"

namespace posed::drivers {

// False for a position that is not finite or lies beyond kMaxPosition_m.
[[nodiscard]] inline bool is_plausible(const Vec3f& position_m) noexcept {
  bool near = true;
  for (const float x_m : position_m) {
    near = near && std::abs(static_cast<double>(x_m)) <= kMaxPosition_m;  // false for NaN
  }
  return near;
}

// Scales a quaternion to unit length. All zero means that the joint was not seen: `seen` becomes
// false and the rotation identity. Returns false for what is no rotation: a component that is not
// finite, or a length further from 1 than `tolerance` explains.
[[nodiscard]] inline bool accept_rotation(Quatf& rotation_xyzw, bool& seen,
                                          double tolerance = 1e-3) noexcept {
  double squared = 0.0;
  for (const float x : rotation_xyzw) squared += static_cast<double>(x) * static_cast<double>(x);
  seen = squared != 0.0;
  if (!seen) {
    rotation_xyzw = kIdentity;
    return true;
  }
  if (!(std::abs(squared - 1.0) <= tolerance)) return false;
  const double length = std::sqrt(squared);
  for (float& x : rotation_xyzw) x = static_cast<float>(static_cast<double>(x) / length);
  return true;
}

}  // namespace posed::drivers
