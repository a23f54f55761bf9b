// MVN's axes and posed's: both right-handed, MVN with X forward, Y left and Z up, posed with Z
// forward, X left and Y up. The same holds for the axis of a rotation. RT-safe.
#pragma once

#include "drivers/byte_reader.hpp"
#include "proto/frame/frame.hpp"

namespace posed::drivers::mvn {

[[nodiscard]] inline Vec3f from_z_up(const Vec3f& v) noexcept { return {v[1], v[2], v[0]}; }
[[nodiscard]] inline Vec3f to_z_up(const Vec3f& v) noexcept { return {v[2], v[0], v[1]}; }

// Three numbers as they stand in the datagram.
[[nodiscard]] inline Vec3f read_vector(BigEndianReader& reader) noexcept {
  Vec3f v;
  for (float& x : v) x = reader.f32();
  return v;
}

// A rotation w, x, y, z about MVN's axes, not yet checked.
[[nodiscard]] inline Quatf read_quaternion(BigEndianReader& reader) noexcept {
  const float w = reader.f32();
  const Vec3f v = from_z_up(read_vector(reader));
  return {v[0], v[1], v[2], w};
}

}  // namespace posed::drivers::mvn
