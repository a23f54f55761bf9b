// The datagrams that Xsens MVN's Network Streamer sends (MXTP), as drawn in "MVN real-time network
// streaming Protocol Specification", revision N of September 2018 (Xsens Technologies). No I/O
// here. All numbers are big-endian; f32 is IEEE 754.
//
// Every datagram:
//
//    0 .. 3    4 5     6 .. 9   10       11      12 .. 15  16          17     18      19
//   +--------+-------+--------+--------+-------+---------+-----------+------+-------+---------+
//   | "MXTP" | type  | sample | part   | items | time    | character | body | props | fingers |
//   +--------+-------+--------+--------+-------+---------+-----------+------+-------+---------+
//    20 21   22 23        24 ...
//   +-------+------------+---------+
//   |   0   | size       | payload |
//   +-------+------------+---------+
//    type       two digits: 01, 02, 05, 12, 13, 20 to 25
//    sample     u32, one more for each sample of the trackers; MVN may leave out samples
//    part       u8, number of the datagram within its sample from 0; bit 7: it is the last one
//    items      u8, items in the payload
//    time       u32 [ms], since the recording began
//    body       u8, 23 segments; props 0 to 4; fingers 0 or 40 segments
//    size       u16, bytes of the payload
//
// Before MVN 2019 bytes 17 to 23 are zero: then the payload is the rest of the datagram.
//
// Pose, an item for each segment: the body, the props, the left hand's fingers, the right hand's:
//
//    01  id (i32) | x, y, z (f32) | rotation about x, y, z (f32)   28 bytes
//    02  id (i32) | x, y, z (f32) | w, x, y, z (f32)               32 bytes
//    05  like 02, the body in another order: pelvis, right leg, left leg, spine, left arm, right
//        arm, neck, head
//
//        axes                                                            unit
//    01  right-handed, Y up, facing +Z, left hand to +X; global          cm, degrees
//    02  right-handed, Z up, facing +X, left hand to +Y; global          m
//    05  left-handed, Y up, facing +Z, left hand to -X; the pelvis is    m
//        global, other segments are relative to their parents
//
// The rotation of 01 turns about X, then Y, then Z, each an axis of the room. All segments are
// unturned in T-pose.
//
//    12  size (i32) | lines "tag:value\n" in UTF-8, among them the character's name
//    13  segments (i32) | each: name size (i32) | name | x, y, z (f32)       the T-pose, as in 02
//        points (i32) | each: segment (u16) | point (u16) | name size (i32) | name | flags (u32) |
//        x, y, z (f32)
//    20  parent point (i32) | child point (i32) | x, y, z (f32)                       20 bytes
//        the angles of a joint, about its segment's axes; a point is 256 segment id + its number
//    21  id (i32) | position | velocity | acceleration, each x, y, z (f32)            40 bytes
//    22  id (i32) | w, x, y, z (f32) | angular velocity | angular acceleration        44 bytes
//    23  segment id (i32) | w, x, y, z (f32) | free acceleration | magnetic field     44 bytes
//        or: ... | free acceleration | acceleration | angular velocity | magnetic field  68 bytes
//    24  centre of mass: x, y, z (f32), perhaps more
//    25  time code: size (i32) | text "HH:MM:SS.mmm" (the vendor's SDK: timecodedatagram.cpp); in
//        logs of posed's own emulator the size may be missing
//
// The axes of 20 to 24 are those of 02; degrees, metres, seconds and radians, for magnetic fields
// no known unit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/mvn/segments.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::mvn {

inline constexpr std::size_t kHeadBytes = 24;
inline constexpr std::size_t kMaxProps = 4;
inline constexpr std::size_t kMaxItems = kSegments + kMaxProps;
inline constexpr std::size_t kMaxPoseBytes = kMaxItems * 32;
inline constexpr std::int32_t kPointsOfSegment = 256;  // numbers of type 20 for each segment

enum class Type : std::uint8_t {
  kEuler = 1,
  kQuaternion = 2,
  kUnity = 5,
  kMeta = 12,
  kScale = 13,
  kJointAngles = 20,
  kLinear = 21,
  kAngular = 22,
  kTrackers = 23,
  kCentreOfMass = 24,
  kTimeCode = 25
};

struct Head {
  Type type = Type::kQuaternion;  // any number of two digits
  std::uint32_t sample = 0;
  std::uint8_t part = 0;
  bool last = true;
  std::uint8_t items = 0;
  std::uint32_t time_ms = 0;
  std::uint8_t character = 0;
  std::uint8_t body = 0;
  std::uint8_t props = 0;
  std::uint8_t fingers = 0;
  std::uint16_t payload_bytes = 0;
  bool old = false;  // before MVN 2019: body, props, fingers and payload_bytes are not reported
};

struct Datagram {
  Head head;
  std::span<const std::byte> payload;
};

// One segment in posed's axes.
struct SegmentPose {
  Vec3f position_m{};
  Quatf rotation_xyzw = kIdentity;
  bool seen = false;
};
// All segments of a character, without the props.
struct CharacterPose {
  std::array<SegmentPose, kSegments> segments;  // [segment]
  bool fingers = false;                         // otherwise only the body's are there
  bool local = false;                           // relative to the parent, otherwise global
};

// Reads the first kHeadBytes of a datagram. False: they are not from MVN.
RT_SAFE [[nodiscard]] bool read_head(std::span<const std::byte> bytes, Head& head) noexcept;

// Returns whether a datagram of this type with these items may have such a payload. Types that
// posed does not know may have any.
RT_SAFE [[nodiscard]] bool is_right_size(const Head& head, std::size_t payload_bytes) noexcept;

// Bytes of an item; 0 for types whose payload is no list of equal items.
RT_SAFE [[nodiscard]] std::size_t item_bytes(Type type) noexcept;
RT_SAFE [[nodiscard]] bool is_pose(Type type) noexcept;

// kOk fills `datagram`; kForeign: not from MVN, or of a type that posed does not know; kShort: cut,
// or longer than it says.
RT_SAFE [[nodiscard]] Outcome decode_datagram(std::span<const std::byte> bytes,
                                              Datagram& datagram) noexcept;

// The items of a whole sample, in their order. kShort: not as many as the head says; kOutOfRange: a
// number is no position or rotation, the ids of the body's segments do not count up, or the head
// names segments that no character has.
RT_SAFE [[nodiscard]] Outcome decode_pose(const Head& head, std::span<const std::byte> items,
                                          CharacterPose& pose) noexcept;

// The character's name in type 12; empty when the datagram does not have it.
RT_SAFE [[nodiscard]] Outcome decode_meta(std::span<const std::byte> payload,
                                          std::string_view& name) noexcept;

// Reads the positions of the body's segments in T-pose, in posed's axes. `reported` is false for
// the datagrams of type 13 that describe only points.
RT_SAFE [[nodiscard]] Outcome decode_scale(std::span<const std::byte> payload,
                                           std::array<Vec3f, kBodySegments>& position_m,
                                           bool& reported) noexcept;

}  // namespace posed::drivers::mvn
