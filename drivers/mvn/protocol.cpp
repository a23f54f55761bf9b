#include "drivers/mvn/protocol.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/byte_reader.hpp"
#include "drivers/mvn/axes.hpp"
#include "drivers/pose_values.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::mvn {
namespace {

constexpr std::string_view kMagic = "MXTP";
constexpr std::size_t kVectorBytes = 12;
constexpr std::size_t kLongTrackerBytes = 68;  // of newer versions
constexpr std::size_t kMinTimeCodeBytes = 8;   // "HH:MM:SS", at least
constexpr std::size_t kMinNameBytes = 4;       // bytes: the size of an empty name
constexpr std::size_t kMinSegmentBytes = 16;   // bytes: an empty name, a position
constexpr float kCentimetre_m = 0.01F;
constexpr std::uint8_t kLast = 0x80;

bool is_known(Type type) noexcept {
  switch (type) {
    case Type::kMeta:
    case Type::kScale:
    case Type::kCentreOfMass:
    case Type::kTimeCode:
      return true;
    default:
      return item_bytes(type) != 0;
  }
}

// A rotation about fixed axes, X first [degrees].
bool read_euler(BigEndianReader& reader, SegmentPose& segment) noexcept {
  const Vec3f degrees = read_vector(reader);
  for (const float x : degrees) {
    if (!(std::abs(static_cast<double>(x)) * kDegree <= kMaxAngle_rad)) return false;
  }
  const auto turn = [&](Axis axis) {
    const double x = static_cast<double>(degrees[static_cast<std::size_t>(axis)]);
    return axis_rotation(axis, x * kDegree);
  };
  segment.rotation_xyzw = from_eigen(turn(Axis::kZ) * turn(Axis::kY) * turn(Axis::kX));
  segment.seen = true;
  return true;
}

// Reads one item without its id: the place in the datagram says which segment it is. False: it is
// no pose.
bool read_segment(Type type, BigEndianReader& reader, SegmentPose& segment) noexcept {
  const Vec3f p = read_vector(reader);
  if (type == Type::kEuler) {
    for (std::size_t i = 0; i < 3; ++i) segment.position_m[i] = p[i] * kCentimetre_m;
    return read_euler(reader, segment) && is_plausible(segment.position_m);
  }
  if (type == Type::kUnity) {  // mirrored at the plane between left and right
    const float w = reader.f32();
    const Vec3f v = read_vector(reader);
    segment.position_m = {-p[0], p[1], p[2]};
    segment.rotation_xyzw = {v[0], -v[1], -v[2], w};
  } else {
    segment.position_m = from_z_up(p);
    segment.rotation_xyzw = read_quaternion(reader);
  }
  return accept_rotation(segment.rotation_xyzw, segment.seen) && is_plausible(segment.position_m);
}

struct Shape {
  std::size_t props = 0;
  bool fingers = false;
};

// What the items of a sample are, from their number.
Outcome shape_of(const Head& head, std::size_t items, Shape& shape) noexcept {
  constexpr std::size_t kFingers = kSegments - kBodySegments;
  if (items < kBodySegments || items > kMaxItems) return Outcome::kShort;
  const std::size_t more = items - kBodySegments;
  if (head.old) {
    shape.fingers = more >= kFingers;
    shape.props = shape.fingers ? more - kFingers : more;
    return shape.props <= kMaxProps ? Outcome::kOk : Outcome::kShort;
  }
  const bool valid = head.body == kBodySegments && head.props <= kMaxProps &&
                     (head.fingers == 0 || head.fingers == kFingers);
  if (!valid) return Outcome::kOutOfRange;
  shape.fingers = head.fingers != 0 && more == head.props + kFingers;
  shape.props = more == 0 ? 0 : head.props;
  return shape.fingers || more == shape.props ? Outcome::kOk : Outcome::kShort;
}

// The name is not kept: the place says which segment it is.
bool skip_name(BigEndianReader& reader) noexcept {
  const std::uint32_t size = reader.u32();
  static_cast<void>(reader.bytes(size));
  return reader.ok();
}

}  // namespace

std::size_t item_bytes(Type type) noexcept {
  switch (type) {
    case Type::kEuler:
      return 28;
    case Type::kQuaternion:
    case Type::kUnity:
      return 32;
    case Type::kJointAngles:
      return 20;
    case Type::kLinear:
      return 40;
    case Type::kAngular:
    case Type::kTrackers:
      return 44;
    default:
      return 0;
  }
}

bool is_pose(Type type) noexcept {
  return type == Type::kEuler || type == Type::kQuaternion || type == Type::kUnity;
}

bool read_head(std::span<const std::byte> bytes, Head& head) noexcept {
  BigEndianReader reader(bytes);
  if (reader.text(kMagic.size()) != kMagic) return false;
  const int tens = reader.u8() - '0';
  const int ones = reader.u8() - '0';
  if (tens < 0 || tens > 9 || ones < 0 || ones > 9) return false;
  head.type = static_cast<Type>(10 * tens + ones);
  head.sample = reader.u32();
  const std::uint8_t part = reader.u8();
  head.part = part & static_cast<std::uint8_t>(~kLast);
  head.last = (part & kLast) != 0;
  head.items = reader.u8();
  head.time_ms = reader.u32();
  head.character = reader.u8();
  head.body = reader.u8();
  head.props = reader.u8();
  head.fingers = reader.u8();
  const std::uint16_t reserved = reader.u16();
  head.payload_bytes = reader.u16();
  head.old = head.body == 0 && head.props == 0 && head.fingers == 0 && reserved == 0 &&
             head.payload_bytes == 0;
  return reader.ok();
}

bool is_right_size(const Head& head, std::size_t payload_bytes) noexcept {
  switch (head.type) {
    case Type::kMeta:
      return payload_bytes >= kMinNameBytes;
    case Type::kScale:
      return payload_bytes >= 2 * sizeof(std::int32_t);
    case Type::kCentreOfMass:
      return payload_bytes >= kVectorBytes;
    case Type::kTimeCode:
      return payload_bytes >= kMinTimeCodeBytes;
    case Type::kTrackers:
      if (payload_bytes == head.items * kLongTrackerBytes) return true;
      break;
    default:
      break;
  }
  return !is_known(head.type) || payload_bytes == head.items * item_bytes(head.type);
}

Outcome decode_datagram(std::span<const std::byte> bytes, Datagram& datagram) noexcept {
  const auto start = BigEndianReader(bytes).text(std::min(bytes.size(), kMagic.size()));
  if (!kMagic.starts_with(start)) return Outcome::kForeign;
  if (bytes.size() < kHeadBytes) return Outcome::kShort;
  if (!read_head(bytes, datagram.head)) return Outcome::kForeign;
  datagram.payload = bytes.subspan(kHeadBytes);
  const Head& head = datagram.head;
  if (!head.old && datagram.payload.size() != head.payload_bytes) return Outcome::kShort;
  if (!is_known(head.type)) return Outcome::kForeign;
  return is_right_size(head, datagram.payload.size()) ? Outcome::kOk : Outcome::kShort;
}

Outcome decode_pose(const Head& head, std::span<const std::byte> items,
                    CharacterPose& pose) noexcept {
  const std::size_t count = items.size() / item_bytes(head.type);
  Shape shape;
  if (const Outcome outcome = shape_of(head, count, shape); outcome != Outcome::kOk) return outcome;
  const bool unity = head.type == Type::kUnity;
  pose.local = unity;
  pose.fingers = shape.fingers && !unity;  // type 05 has none
  BigEndianReader reader(items);
  const std::size_t wanted = pose.fingers ? kSegments + shape.props : kBodySegments;
  bool valid = true;
  std::int32_t before = 0;
  for (std::size_t i = 0; i < wanted; ++i) {
    const std::int32_t id = reader.i32();
    // 01 and 02 count the segments up, from any number, or have no ids, which are 0.
    const bool same = std::int64_t{id} == std::int64_t{before} + 1 || (id == 0 && before == 0);
    const bool counts = same || i == 0 || i >= kBodySegments || unity;
    valid = valid && counts;
    before = id;
    const bool prop = i >= kBodySegments && i < kBodySegments + shape.props;
    SegmentPose ignored;
    const std::size_t segment =
        i < kBodySegments ? (unity ? kUnitySegments[i] : i) : i - shape.props;
    SegmentPose& to = prop ? ignored : pose.segments[segment];
    valid = (read_segment(head.type, reader, to) || prop) && valid;
  }
  return valid ? Outcome::kOk : Outcome::kOutOfRange;
}

Outcome decode_meta(std::span<const std::byte> payload, std::string_view& name) noexcept {
  constexpr std::string_view kTag = "name:";
  BigEndianReader reader(payload);
  const std::uint32_t size = reader.u32();
  std::string_view text = reader.text(size);
  if (!reader.ok() || reader.left() != 0) return Outcome::kShort;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (text.starts_with(kTag)) name = text.substr(kTag.size(), end - kTag.size());
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return Outcome::kOk;
}

Outcome decode_scale(std::span<const std::byte> payload,
                     std::array<Vec3f, kBodySegments>& position_m, bool& reported) noexcept {
  BigEndianReader reader(payload);
  const std::uint32_t segments = reader.u32();
  if (segments > reader.left() / kMinSegmentBytes) return Outcome::kShort;
  bool valid = true;
  for (std::size_t i = 0; i < segments; ++i) {
    if (!skip_name(reader)) return Outcome::kShort;
    const Vec3f p = from_z_up(read_vector(reader));
    if (!reader.ok()) return Outcome::kShort;
    valid = valid && is_plausible(p);
    if (i < kBodySegments) position_m[i] = p;
  }
  const std::uint32_t points = reader.u32();
  for (std::size_t i = 0; i < points && reader.ok(); ++i) {
    static_cast<void>(reader.u32());  // segment and point
    if (!skip_name(reader)) return Outcome::kShort;
    static_cast<void>(reader.bytes(sizeof(std::uint32_t) + kVectorBytes));
  }
  if (!reader.ok() || reader.left() != 0) return Outcome::kShort;
  reported = segments != 0;
  return valid && (!reported || segments >= kBodySegments) ? Outcome::kOk : Outcome::kOutOfRange;
}

}  // namespace posed::drivers::mvn
