// The description of the bodies, which Studio does not send: the decoder writes it from the frames,
// layout.cpp compiles it. All numbers are little-endian.
//
//   +---------------+-------------------------------------------------------------------------+
//   | bodies (u8)   | then each body:                                                         |
//   +---------------+-------------------------------------------------------------------------+
//
//   +------+------+-----------+------+--------------+-----------------------------------------+
//   | part | face | name size | name | joints (u64) | each of them but the first: x, y, z     |
//   +------+------+-----------+------+--------------+-----------------------------------------+
//    part     u8, 0 a person, 1 and 2 the left and right hand of a person without a body, 3 a prop
//    face     u8, 1: it has the face values, too
//    name     u8 and 0 to 64 bytes as Studio sent them
//    joints   bit j: joint j of joints.hpp; bit 0 of a prop; none: only the face values
//    bodies   kOnlyNamedJoints: Studio sends people of JSON v4 and nobody else; nothing follows
//    x, y, z  3 x f32 [m], from the nearest ancestor among the joints, in that one's frame
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/rokoko/joints.hpp"
#include "drivers/rokoko/studio_frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::rokoko {

enum class Part : std::uint8_t { kPerson, kLeftHand, kRightHand, kProp };

// The key that distinguishes bodies: two actors' hands have the same part, an actor's hands the
// same name.
struct BodyKey {
  Part part = Part::kPerson;
  StudioName name;
  friend bool operator==(const BodyKey& a, const BodyKey& b) noexcept {
    return a.part == b.part && a.name == b.name;
  }
};

struct DescribedBody {
  BodyKey key;
  bool face = false;
  JointSet joints;
  std::array<Vec3f, kStudioJoints> offset_m{};  // [joint]
};

inline constexpr std::size_t kMaxBodyBytes = 3 + kMaxNameBytes + 8 + kStudioJoints * 12;
inline constexpr std::size_t kMaxDescriptionBytes = 1 + kMaxBodies * kMaxBodyBytes;
inline constexpr std::uint8_t kOnlyNamedJoints = 255;
static_assert(kMaxDescriptionBytes <= kMaxDescription);

// Writes one body and returns its length; `room` has at least kMaxBodyBytes.
RT_SAFE [[nodiscard]] std::size_t write_body(const DescribedBody& body,
                                             std::span<std::byte> room) noexcept;

// The bytes are untrusted. Cold.
Result<std::vector<DescribedBody>> parse_description(std::span<const std::byte> bytes);

}  // namespace posed::drivers::rokoko
