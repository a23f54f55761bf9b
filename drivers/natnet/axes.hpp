// The axes of Motive: right-handed with Y up, as in posed, or with Z up when it is set so. All of
// them are RT-safe.
#pragma once

#include "proto/frame/frame.hpp"

namespace posed::drivers::natnet {

// Z up: Motive's X, Z and -Y are posed's X, Y and Z. The same holds for the axis of a rotation.
[[nodiscard]] inline Vec3f from_motive(const Vec3f& v, bool z_up) noexcept {
  return z_up ? Vec3f{v[0], v[2], -v[1]} : v;
}
[[nodiscard]] inline Quatf from_motive(const Quatf& q, bool z_up) noexcept {
  return z_up ? Quatf{q[0], q[2], -q[1], q[3]} : q;
}

[[nodiscard]] inline Vec3f to_motive(const Vec3f& v, bool z_up) noexcept {
  return z_up ? Vec3f{v[0], -v[2], v[1]} : v;
}
[[nodiscard]] inline Quatf to_motive(const Quatf& q, bool z_up) noexcept {
  return z_up ? Quatf{q[0], -q[2], q[1], q[3]} : q;
}

}  // namespace posed::drivers::natnet
