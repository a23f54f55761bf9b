#include "drivers/template_mocap/protocol.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "drivers/byte_reader.hpp"
#include "drivers/byte_writer.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::mocap {
namespace {

constexpr std::string_view kMagic = "MCAP";
constexpr std::size_t kHeadBytes = 8;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::size_t kMinJointBytes = 15;  // bytes: a name of one letter, parent, offset

std::uint32_t checksum(std::span<const std::byte> bytes) noexcept {
  return static_cast<std::uint32_t>(
      ::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void write_name(ByteWriter& writer, const std::string& name) {
  writer.u8(static_cast<std::uint8_t>(name.size()));
  writer.text(name);
}

std::unexpected<Error> wrong(const std::string& what) {
  return fail("the mocap system's description " + what +
              "; restart its server, or update it if that does not help");
}

Result<std::string> read_name(ByteReader& reader) {
  const std::string_view name = reader.text(reader.u8());
  if (!reader.ok()) return wrong("ends too early");
  if (name.empty()) return wrong("has an empty name");
  // Other programs get the names in messages that must be UTF-8.
  if (clean(name) != name) return wrong("has a name that is not text: " + in_quotes(name));
  return std::string(name);
}

Result<BodyEntry> read_body(ByteReader& reader) {
  BodyEntry body;
  body.id = reader.u16();
  auto name = TRY(read_name(reader));
  body.name = std::move(name);
  const std::string place = "of body " + in_quotes(body.name) + " ";
  const std::size_t joints = reader.u8();
  if (joints == 0 || joints > kMaxJoints) {
    return wrong(place + "has " + std::to_string(joints) + " joints instead of 1 to " +
                 std::to_string(kMaxJoints));
  }
  if (joints * kMinJointBytes > reader.left()) return wrong(place + "ends too early");
  std::set<std::string, std::less<>> names;
  for (std::size_t j = 0; j < joints; ++j) {
    auto joint_name = TRY(read_name(reader));
    if (!names.insert(joint_name).second) {
      return wrong(place + "has two joints " + in_quotes(joint_name));
    }
    JointEntry& joint = body.joints.emplace_back();
    joint.name = std::move(joint_name);
    const int parent = reader.u8();
    joint.parent = parent == 0xff ? -1 : parent;
    for (float& x_m : joint.offset_m) x_m = reader.f32();
    if (!reader.ok()) return wrong(place + "ends too early");
    const bool rooted =
        j == 0 ? joint.parent == -1 : joint.parent >= 0 && joint.parent < static_cast<int>(j);
    if (!rooted) return wrong(place + "gives joint " + in_quotes(joint.name) + " a wrong parent");
    const bool near = std::ranges::all_of(joint.offset_m, [](float x_m) {
      return std::abs(static_cast<double>(x_m)) <= kMaxPosition_m;
    });
    if (!near) return wrong(place + "puts joint " + in_quotes(joint.name) + " out of the room");
  }
  return body;
}

}  // namespace

RT_SAFE Outcome decode_datagram(std::span<const std::byte> bytes, Datagram& datagram) noexcept {
  ByteReader reader(bytes);
  if (reader.text(kMagic.size()) != kMagic) return Outcome::kForeign;
  const std::uint8_t kind = reader.u8();
  const std::uint8_t zero = reader.u8();
  const std::size_t length = reader.u16();
  if (!reader.ok() || reader.left() != length + kChecksumBytes) return Outcome::kShort;
  datagram.content = reader.bytes(length);
  if (reader.u32() != checksum(bytes.first(kHeadBytes + length))) return Outcome::kBadChecksum;
  if (kind < 1 || kind > 3 || zero != 0) return Outcome::kForeign;
  datagram.kind = static_cast<Kind>(kind);
  return Outcome::kOk;
}

Result<std::vector<BodyEntry>> parse_description(std::span<const std::byte> content) {
  if (content.size() > kMaxDescription) return wrong("is too long");
  ByteReader reader(content);
  const std::size_t count = reader.u8();
  if (!reader.ok()) return wrong("is empty");
  if (count > kMaxBodies) {
    return wrong("has " + std::to_string(count) + " bodies, more than " +
                 std::to_string(kMaxBodies));
  }
  std::vector<BodyEntry> bodies;
  std::set<std::string, std::less<>> names;
  std::set<std::uint16_t> ids;
  for (std::size_t i = 0; i < count; ++i) {
    auto body = TRY(read_body(reader));
    if (!names.insert(body.name).second || !ids.insert(body.id).second) {
      return wrong("has two bodies with the name or number of " + in_quotes(body.name));
    }
    bodies.push_back(std::move(body));
  }
  if (reader.left() != 0) return wrong("goes on after its last body");
  return bodies;
}

std::vector<std::byte> encode_datagram(Kind kind, std::span<const std::byte> content) {
  ByteWriter writer;
  writer.text(kMagic);
  writer.u8(static_cast<std::uint8_t>(kind));
  writer.u8(0);
  writer.u16(static_cast<std::uint16_t>(content.size()));
  writer.bytes(content);
  writer.u32(checksum(writer.written()));
  return writer.finish();
}

std::vector<std::byte> encode_request() { return encode_datagram(Kind::kRequest, {}); }

std::vector<std::byte> encode_description(std::span<const BodyEntry> bodies) {
  ByteWriter writer;
  writer.u8(static_cast<std::uint8_t>(bodies.size()));
  for (const BodyEntry& body : bodies) {
    writer.u16(body.id);
    write_name(writer, body.name);
    writer.u8(static_cast<std::uint8_t>(body.joints.size()));
    for (const JointEntry& joint : body.joints) {
      write_name(writer, joint.name);
      writer.u8(static_cast<std::uint8_t>(joint.parent));
      for (const float x_m : joint.offset_m) writer.f32(x_m);
    }
  }
  return encode_datagram(Kind::kDescription, writer.finish());
}

std::vector<std::byte> encode_frame(const FramePacket& frame) {
  ByteWriter writer;
  writer.u32(frame.number);
  writer.u32(frame.time_us);
  writer.u8(static_cast<std::uint8_t>(frame.bodies.size()));
  for (const BodyPose& body : frame.bodies) {
    writer.u16(body.id);
    writer.u8(static_cast<std::uint8_t>(body.rotation_xyzw.size()));
    for (const float x_m : body.root_m) writer.f32(x_m);
    for (const Quatf& rotation : body.rotation_xyzw) {
      for (const float x : rotation) writer.f32(x);
    }
  }
  return encode_datagram(Kind::kFrame, writer.finish());
}

Result<std::shared_ptr<const Skeleton>> skeleton_of(const BodyEntry& body) {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = body.name;
  for (const JointEntry& entry : body.joints) {
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = entry.name;
    joint.parent = entry.parent;
    joint.offset_m = {entry.offset_m[0], entry.offset_m[1], entry.offset_m[2]};
  }
  TRY(skeleton->finish());
  return skeleton;
}

}  // namespace posed::drivers::mocap
