// From a pose of an Axis figure to the values of a message: the sending side, for the emulator and
// for outputs.
#pragma once

#include <array>
#include <bitset>
#include <span>

#include "drivers/axis/bones.hpp"
#include "drivers/axis/protocol.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers::axis {

// What of the last pose the next one is made from: angles are taken near the last ones, so that
// none jumps, and a joint that has not turned keeps them, as the fingers of most people do.
struct LastPose {
  std::array<std::array<double, 3>, kBones + 1> near_rad{};  // [joint]
  std::array<Quatf, kBones + 1> rotation_xyzw{};             // [joint]; zero: none yet
};
using Turned = std::bitset<kBones + 1>;  // [joint]

// Fills `message.values` for its content and returns which joints have other angles than in the
// message before, which must be the same object. `skeleton` is one of skeleton_of() (layout.hpp),
// with a reference if the content has one; `rotation_xyzw` is [joint], `root_m` where the hips are.
// `offset_cm` is sent as displacement.
RT_SAFE Turned fill_values(const Skeleton& skeleton, const Proportions& offset_cm,
                           std::span<const Quatf> rotation_xyzw, const Vec3f& root_m,
                           LastPose& last, Message& message) noexcept;

}  // namespace posed::drivers::axis
