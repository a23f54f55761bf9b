// The characters of an MVN stream as bodies. MVN does not list them, so the decoder writes this
// description of those that it receives, little-endian:
//
//     0     1       then each character:
//   +-----+-------+-----------+-------+-----------+------+------------------------------------+
//   |  1  | count | character | flags | name size | name | each segment: offset x, y, z (f32) |
//   +-----+-------+-----------+-------+-----------+------+------------------------------------+
//    flags      u8, 1: with fingers; 2 and the higher bits: the groups of values (values.hpp)
//    name size  u8, bytes of the name as type 12 reported it; 0 when it did not
//    offset     [m], in posed's axes, from the parent in T-pose; of 23 segments, or of 63 with
//               fingers; of the pelvis the height above the floor
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/mvn/segments.hpp"
#include "drivers/mvn/values.hpp"

namespace posed::drivers::mvn {

inline constexpr std::size_t kMaxCharacters = 32;
inline constexpr std::size_t kMvnNameBytes = 60;

// The knowledge about a character: a plain struct, because the decoder keeps it.
struct Character {
  std::uint8_t id = 0;
  bool fingers = false;
  ValueGroups values;  // those that it has sent
  std::uint8_t name_bytes = 0;
  std::array<char, kMvnNameBytes> name{};
  std::array<Vec3f, kSegments> offset_m{};  // [segment]

  [[nodiscard]] std::size_t segments() const noexcept {
    return fingers ? kSegments : kBodySegments;
  }
};

// The longest description that write_description makes.
inline constexpr std::size_t kMaxCharacterBytes = 3 + kMvnNameBytes + kSegments * sizeof(Vec3f);
inline constexpr std::size_t kMaxMvnDescription = 2 + kMaxCharacters * kMaxCharacterBytes;

// Writes the head, and one character after the other; each returns the bytes written.
RT_SAFE std::size_t write_description_head(std::size_t characters,
                                           std::span<std::byte> to) noexcept;
std::size_t write_character(const Character& character, std::span<std::byte> to) noexcept;

class MvnLayout final : public SourceLayout {
 public:
  struct Entry {
    std::uint8_t character = 0;
    bool fingers = false;
    ValueGroups groups;
    ValuePlaces values{};
  };
  std::vector<Entry> entries;  // [body]

  // The index of a body; bodies.size() when there is no such body.
  RT_SAFE [[nodiscard]] std::size_t body_of(std::uint8_t character) const noexcept;
};

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

// "Factory", or "character-0" for one without a name. Cold.
[[nodiscard]] std::string body_name(const Character& character);

// The skeleton of a character. Cold.
Result<std::shared_ptr<const Skeleton>> skeleton_of(const Character& character);

}  // namespace posed::drivers::mvn
