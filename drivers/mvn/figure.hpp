// Characters as MVN sends them: an average one, and their poses. For the emulator and for outputs.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "drivers/mvn/layout.hpp"
#include "drivers/mvn/protocol.hpp"

namespace posed::drivers::mvn {

// Sets the name, cut where it is too long. Cold.
void set_name(Character& character, std::string_view name);

// An average person, all lengths times `scale`. Cold.
[[nodiscard]] Character average_character(std::uint8_t id, std::string_view name, float scale,
                                          bool fingers);

// [segment], from the parent; all zero: not seen, and turned as its parent.
using Rotations = std::array<Quatf, kSegments>;

// All segments in the room, or each from its parent (`local`).
[[nodiscard]] CharacterPose pose_of(const Character& character, const Vec3f& root_m,
                                    const Rotations& rotations, bool local);

// The places of the body's segments in T-pose, the pelvis at its height above the floor.
[[nodiscard]] std::array<Vec3f, kBodySegments> t_pose_of(const Character& character);

}  // namespace posed::drivers::mvn
