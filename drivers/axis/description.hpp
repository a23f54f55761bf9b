// The description of the avatars of a stream. The streams of Axis have none, so the decoder writes
// this one of its own; make_layout reads it. Little-endian:
//
//   +------------+--------------+----------------------------------------------------------------+
//   | order (u8) | avatars (u8) | then each avatar:                                              |
//   +------------+--------------+----------------------------------------------------------------+
//                               | number (u32) | flags (u8) | name (32) | offsets of bones 1 to 58
//                               |
//                               +--------------+------------+-----------+-------------------------+
//    order     of the rotations, an index of kOrderNames
//    flags     1: the values begin with a reference; 2: the offsets are there; 4, 8: the options
//              say that the figure is Axis Neuron's, Axis Studio's
//    name      zeros fill it
//    offsets   3 x f32 [cm]
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/axis/bones.hpp"
#include "drivers/axis/protocol.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::axis {

// In the order of the values, the first outermost.
inline constexpr std::array<std::string_view, 6> kOrderNames{"YXZ", "XYZ", "XZY",
                                                             "YZX", "ZXY", "ZYX"};

struct AvatarEntry {
  Avatar avatar;
  bool reference = false;
  bool measured = false;  // the stream carries displacement; otherwise the default proportions
  std::optional<Figure> figure{};  // that the options say
  Proportions offset_cm = default_proportions();
};

// What the options say; otherwise by measured offsets; otherwise Axis Neuron's.
[[nodiscard]] Figure figure_of(const AvatarEntry& entry) noexcept;

struct AvatarList {
  std::uint8_t order = 0;
  std::vector<AvatarEntry> avatars;
};

inline constexpr std::size_t kListHeadBytes = 2;
inline constexpr std::size_t kMaxEntryBytes = 4 + 1 + kNameBytes + 12 * (kBones - 1);
static_assert(kListHeadBytes + kMaxBodies * kMaxEntryBytes <= kMaxDescription);

// Write the head, and an avatar behind it, and return the number of bytes.
RT_SAFE std::size_t write_list_head(std::uint8_t order, std::size_t avatars,
                                    std::span<std::byte> out) noexcept;
std::size_t write_entry(const AvatarEntry& entry, std::span<std::byte> out) noexcept;

// Cold; the bytes are untrusted.
Result<AvatarList> parse_list(std::span<const std::byte> bytes);

// The axes of an order, by its index in kOrderNames.
[[nodiscard]] std::array<Axis, 3> order_axes(std::uint8_t order);

}  // namespace posed::drivers::axis
