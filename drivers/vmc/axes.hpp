// Between Unity's axes, in which the VMC protocol speaks, and posed's. Both have Y up and a person
// facing +Z, but Unity's are left-handed: there the left hand is at -X. So the map mirrors X, and
// so does the map back. A mirror turns the axis of a rotation as it turns a point and reverses its
// sense: (x, y, z, w) becomes (x, -y, -z, w). RT-safe.
#pragma once

#include "proto/frame/frame.hpp"

namespace posed::drivers::vmc {

// Subtracted from zero, because the bytes of -0 would differ from those that other senders send.
[[nodiscard]] inline Vec3f mirrored(const Vec3f& position_m) noexcept {
  return {0.0F - position_m[0], position_m[1], position_m[2]};
}
[[nodiscard]] inline Quatf mirrored(const Quatf& xyzw) noexcept {
  return {xyzw[0], 0.0F - xyzw[1], 0.0F - xyzw[2], xyzw[3]};
}

}  // namespace posed::drivers::vmc
