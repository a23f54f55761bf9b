// Builds MVN's datagrams, for the emulator and for outputs. Cold: allocates.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/mvn/protocol.hpp"

namespace posed::drivers::mvn {

// The head with `payload`, whose size it has.
[[nodiscard]] std::vector<std::byte> encode_datagram(const Head& head,
                                                     std::span<const std::byte> payload);

// The payload of a pose of type 01, 02 or 05 without props. The pose is global, in posed's axes;
// for 05 it is local. A segment that was not seen has no rotation: all zero in 02 and 05.
[[nodiscard]] std::vector<std::byte> encode_pose(Type type, const CharacterPose& pose);

[[nodiscard]] std::vector<std::byte> encode_meta(std::string_view name);

// Writes the positions of the body's segments in T-pose, given in posed's axes.
[[nodiscard]] std::vector<std::byte> encode_scale(std::span<const Vec3f, kBodySegments> position_m);

// The items of type 20, 21, 22 or 23 for a body at rest: the angles, positions or rotations of a
// global pose in posed's axes; velocities, accelerations and magnetic fields are zero. Of 23 those
// of 44 bytes, on the 17 segments where a suit has trackers.
[[nodiscard]] std::vector<std::byte> encode_values(Type type, const CharacterPose& pose);

// `text` is "HH:MM:SS.mmm".
[[nodiscard]] std::vector<std::byte> encode_timecode(std::string_view text);

[[nodiscard]] std::vector<std::byte> encode_centre_of_mass(const Vec3f& position_m);

// Cuts a pose's payload into datagrams of at most `longest` bytes, each with whole items.
[[nodiscard]] std::vector<std::vector<std::byte>> encode_sample(const Head& head,
                                                                std::span<const std::byte> payload,
                                                                std::size_t longest);

}  // namespace posed::drivers::mvn
