// The motion streams of Axis Neuron, Axis Neuron Pro and Axis Studio (Noitom, Perception Neuron):
// the same values as a line of their BVH files, for one avatar a message, over TCP or UDP. From the
// vendor's NeuronDataReader SDK (DataType.h) and programs that read the streams; the README says
// what is not confirmed. No I/O here. All numbers are little-endian; f32 is IEEE 754.
//
// Binary message: a header of 64 bytes, then `count` values (f32).
//
//      0 1     2 .. 5     6 7    8      9      10 .. 13   14 .. 45   46 .. 49   50 .. 61   62 63
//   +-------+----------+-------+------+------+----------+----------+----------+----------+-------+
//   | FF DD | version  | count | disp | ref  |  avatar  |   name   |  number  | reserved | FF EE |
//   +-------+----------+-------+------+------+----------+----------+----------+----------+-------+
//    version   u8 build, revision, minor, major; this form from 1.1 on
//    count     u16, values that follow: 354 with displacement, 180 without, 6 more with reference
//    disp      u8, 1: every bone has a position
//    ref       u8, 1: the values begin with those of a bone above the hips
//    avatar    u32, from 0
//    name      of the avatar, zero-terminated if shorter than 32 bytes
//    number    u32 of the frame; 0 where the sender does not count
//
// A binary message of version 1.0 has this head:
//
//      0 1     2 .. 5     6 .. 9   10 .. 13   14 .. 17   18 .. 21   22 .. 53   54 .. 61   62 63
//   +-------+----------+----------+----------+----------+----------+----------+----------+-------+
//   | FF DD | version  |  count   |   disp   |   ref    |  avatar  |   name   | reserved | FF EE |
//   +-------+----------+----------+----------+----------+----------+----------+----------+-------+
//
// A header with FF 88 instead of FF DD, and FF 99 at its end, begins a message of calculation data
// (sensor values), which posed does not use.
//
// Text message: the avatar, its name, and the values in decimal, separated by blanks; then "||".
//
//   0 Walker -8.964398 108.673515 16.348038 -10.676419 -5.120858 ... ||
//
// Values, all of the reference first, then of each bone (bones.hpp): position x, y, z [cm], then
// three rotations [deg] in the order that is set in the application, the first outermost. Without
// displacement only the reference and the hips have positions. Positions replace the offset of a
// BVH. Axes: right-handed, Y up, in T-pose facing +Z: as in posed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "drivers/axis/bones.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::axis {

inline constexpr std::size_t kHeaderBytes = 64;
inline constexpr std::size_t kNameBytes = 32;
inline constexpr std::uint32_t kMaxAvatar = 9999;  // number; a greater one is damage
inline constexpr std::size_t kMaxValues = 6 + 6 * kBones;
inline constexpr std::size_t kMaxBinary = kHeaderBytes + 4 * kMaxValues;
inline constexpr std::size_t kMaxText = 16 * 1024;  // 45 bytes a value
inline constexpr std::string_view kTextEnd = "||";

// Says which values a message has.
struct Content {
  bool displacement = false;
  bool reference = false;

  bool operator==(const Content&) const = default;
};

// 354, 180, 360 or 186.
RT_SAFE [[nodiscard]] constexpr std::size_t value_count(Content content) noexcept {
  return (content.reference ? 6 : 0) + (content.displacement ? 6 * kBones : 3 + 3 * kBones);
}
// Returns the place of a bone's rotations among the values; its position, if it has one, is before
// them.
RT_SAFE [[nodiscard]] constexpr std::size_t rotations_at(Content content,
                                                         std::size_t bone) noexcept {
  return (content.reference ? 6 : 0) + 3 + (content.displacement ? 6 : 3) * bone;
}

// Which avatar: two avatars may have the same name, but then have different numbers.
struct Avatar {
  std::uint32_t number = 0;
  std::array<char, kNameBytes> name{};  // zeros fill it

  bool operator==(const Avatar&) const = default;
  [[nodiscard]] std::string_view name_text() const noexcept;
};
// The name is cut at kNameBytes.
RT_SAFE [[nodiscard]] Avatar make_avatar(std::uint32_t number, std::string_view name) noexcept;

enum class Form : std::uint8_t { kBinary, kOldBinary, kText };
inline constexpr std::array<std::string_view, 3> kFormNames{"binary", "binary-1.0", "text"};

// The text of three values, as "0.000000 12.345678 -3.000000" between blanks.
struct ShortText {
  std::array<char, 63> text{};
  std::uint8_t size = 0;  // 0: none
};

// One message, as it is sent and as it is received.
struct Message {
  Avatar avatar;
  Content content;
  std::uint32_t frame_number = 0;  // 0: not counted
  std::array<double, kMaxValues> values{};
};

// The length in bytes of the binary message that begins with these kHeaderBytes bytes, in `size`.
// kForeign: calculation data, or no header. kOutOfRange: a header with counts, flags or an avatar
// that cannot be.
RT_SAFE [[nodiscard]] Outcome measure_binary(std::span<const std::byte> header,
                                             std::size_t& size) noexcept;

// Decodes a binary message of that length. kOutOfRange: a value that no pose has.
RT_SAFE [[nodiscard]] Outcome decode_binary(std::span<const std::byte> bytes,
                                            Message& message) noexcept;

// Decodes a text message without its "||". kShort: another number of values. kOutOfRange: a value
// that is no number or that no pose has, or such an avatar. A name of several words is accepted if
// one of them is no number.
RT_SAFE [[nodiscard]] Outcome decode_text(std::string_view text, Message& message) noexcept;

// Encode a message into `out` and return its length, 0 when `out` is too small. A binary message
// needs kHeaderBytes + 4 * value_count() bytes, a text message at most kMaxText; nothing is
// allocated. Text has six decimals, as the vendor's BVH files do, and '_' for what a name cannot
// contain.
RT_SAFE [[nodiscard]] std::size_t encode_binary(const Message& message, Form form,
                                                std::span<std::byte> out) noexcept;
// `known` is [group of three values] their text, which is written again as it is; where it is empty
// it is made of the values and kept there.
[[nodiscard]] std::size_t encode_text(const Message& message, std::span<char> out,
                                      std::span<ShortText> known = {}) noexcept;

}  // namespace posed::drivers::axis
