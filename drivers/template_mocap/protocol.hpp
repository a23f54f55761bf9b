// The datagrams of the template mocap system, invented for posed: it follows several bodies and
// sends them over UDP. No I/O here: the drawings below are the whole format, and the emulator
// builds its datagrams with the same functions. All numbers are little-endian; f32 is IEEE 754.
//
// Every datagram:
//
//     0 .. 3     4       5       6   7      8 ...        last 4
//   +--------+-------+-------+---------+-----------+-------------+
//   | "MCAP" | kind  |   0   | length  |  content  |  checksum   |
//   +--------+-------+-------+---------+-----------+-------------+
//    kind       u8, 1 request, 2 description, 3 frame
//    length     u16, bytes of the content
//    checksum   u32, CRC-32 of all bytes before it
//
// Request (host to device, no content): describe your bodies.
//
// Description: u8 bodies, then each body:
//
//   +----------+-----------+------+---------------------------------------------+
//   | id (u16) | name size | name | joints (u8), then each joint:               |
//   +----------+-----------+------+---------------------------------------------+
//                                 | name size | name | parent | offset x, y, z  |
//                                 +-----------+------+--------+-----------------+
//    name size   u8, 1 to 255 bytes of UTF-8 follow
//    parent      i8, index of an earlier joint, depth first; -1 for the first joint
//    offset      3 x f32 [m], from the parent, when the body stands in its T-pose
//
// Frame:
//
//   +--------------+------------+-------------+--------------------------------------------+
//   | number (u32) | time (u32) | bodies (u8) | then each body:                            |
//   +--------------+------------+-------------+--------------------------------------------+
//                               | id (u16) | joints (u8) | x, y, z | each joint: x, y, z, w |
//                               +----------+-------------+---------+------------------------+
//    number      one more each frame, wraps
//    time        [us], wraps after 71 minutes
//    x, y, z     3 x f32 [m], position of the first joint in the room
//    x, y, z, w  4 x f32, rotation relative to the parent; all zero: not seen
//
// Axes: right-handed, Y up, in T-pose facing +Z: as in posed. A driver of a device with other axes
// converts them in parse_description and in the decoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers::mocap {

enum class Kind : std::uint8_t { kRequest = 1, kDescription = 2, kFrame = 3 };

struct Datagram {
  Kind kind = Kind::kRequest;
  std::span<const std::byte> content;
};

struct JointEntry {
  std::string name;
  int parent = -1;
  Vec3f offset_m{};
};
struct BodyEntry {
  std::uint16_t id = 0;
  std::string name;
  std::vector<JointEntry> joints;
};

struct BodyPose {
  std::uint16_t id = 0;
  Vec3f root_m{};
  std::vector<Quatf> rotation_xyzw;  // [joint]
};
struct FramePacket {
  std::uint32_t number = 0;
  std::uint32_t time_us = 0;
  std::vector<BodyPose> bodies;
};

// kOk fills `datagram`; kForeign: not of this device; kShort: cut, or longer than it says;
// kBadChecksum.
RT_SAFE [[nodiscard]] Outcome decode_datagram(std::span<const std::byte> bytes,
                                              Datagram& datagram) noexcept;

// The content of a description, which is untrusted: at most kMaxBodies bodies with 1 to kMaxJoints
// joints, no two with the same id or name. Cold.
Result<std::vector<BodyEntry>> parse_description(std::span<const std::byte> content);

// The datagrams as the device and the host send them. Cold.
[[nodiscard]] std::vector<std::byte> encode_datagram(Kind kind, std::span<const std::byte> content);
[[nodiscard]] std::vector<std::byte> encode_request();
[[nodiscard]] std::vector<std::byte> encode_description(std::span<const BodyEntry> bodies);
[[nodiscard]] std::vector<std::byte> encode_frame(const FramePacket& frame);

// Makes the skeleton of a body as it was described. Cold.
Result<std::shared_ptr<const Skeleton>> skeleton_of(const BodyEntry& body);

}  // namespace posed::drivers::mocap
