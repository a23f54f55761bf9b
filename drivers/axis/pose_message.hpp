// From a pose of an Axis figure to the values of a message: the sending side, for the emulator and
// for outputs.
#pragma once

#include <array>
#include <span>

#include "drivers/axis/bones.hpp"
#include "drivers/axis/protocol.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers::axis {

// The angles of the last pose, near which those of the next one are taken, so that none jumps.
using NearAngles = std::array<std::array<double, 3>, kBones + 1>;  // [joint] rad

// Fills `message.values` for its content. `skeleton` is one of skeleton_of() (layout.hpp), with a
// reference if the content has one; `rotation_xyzw` is [joint], `root_m` where the hips are.
// `offset_cm` is sent as displacement.
RT_SAFE void fill_values(const Skeleton& skeleton, const Proportions& offset_cm,
                         std::span<const Quatf> rotation_xyzw, const Vec3f& root_m,
                         NearAngles& near_rad, Message& message) noexcept;

}  // namespace posed::drivers::axis
