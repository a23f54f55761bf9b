#include "drivers/mvn/encode.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>

#include "drivers/byte_writer.hpp"
#include "drivers/mvn/axes.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::mvn {
namespace {

constexpr int kTextDigits = 10;

// In one piece, because most of a datagram is numbers.
template <std::size_t count>
void write_words(BigEndianWriter& writer, std::array<std::uint32_t, count> words) {
  if constexpr (std::endian::native == std::endian::little) {
    for (std::uint32_t& word : words) word = std::byteswap(word);
  }
  writer.bytes(std::as_bytes(std::span(words)));
}

std::uint32_t bits(float value) { return std::bit_cast<std::uint32_t>(value); }

void write_vector(BigEndianWriter& writer, const Vec3f& v) {
  write_words(writer, std::array{bits(v[0]), bits(v[1]), bits(v[2])});
}

// The angle whose sine and cosine are in this proportion [degrees]; 0 if both are 0. The polynomial
// is that of Cephes (atanf.c), within 1e-7 rad of the arc tangent up to 22.5 degrees, and several
// times as fast as the library's function.
float angle_deg(double sine, double cosine) {
  constexpr double kEighth = std::numbers::pi / 4.0;
  const double s = std::abs(sine), c = std::abs(cosine);
  const double shorter = std::min(s, c), longer = std::max(s, c);
  const bool steep = shorter > (std::numbers::sqrt2 - 1.0) * longer;
  const double above = steep ? shorter - longer : shorter;
  const double below = steep ? shorter + longer : longer;
  const double t = below > 0.0 ? above / below : 0.0;
  const double z = t * t;
  double angle_rad =
      t + t * z *
              (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z -
               3.33329491539e-1);
  if (steep) angle_rad += kEighth;
  if (s > c) angle_rad = 2.0 * kEighth - angle_rad;
  if (cosine < 0.0) angle_rad = 4.0 * kEighth - angle_rad;
  return static_cast<float>(std::copysign(angle_rad, sine) / kDegree);
}

// Angles about the fixed axes X, Y, Z, in this order of turning [degrees]. Each is read after the
// one before is undone, so that they make the rotation exactly even where X and Z are one axis.
Vec3f to_euler(const Quatf& rotation) {
  const Eigen::Matrix3d m = to_eigen_double(rotation).toRotationMatrix();
  const double length = std::sqrt(m(0, 0) * m(0, 0) + m(1, 0) * m(1, 0));
  const double c = length > 0.0 ? m(0, 0) / length : 1.0;
  const double s = length > 0.0 ? m(1, 0) / length : 0.0;
  return {angle_deg(s * m(0, 2) - c * m(1, 2), c * m(1, 1) - s * m(0, 1)),
          angle_deg(-m(2, 0), length), angle_deg(m(1, 0), m(0, 0))};
}

void write_rotation(BigEndianWriter& writer, const Quatf& q) {
  const Vec3f axis = to_z_up({q[0], q[1], q[2]});
  write_words(writer, std::array{bits(q[3]), bits(axis[0]), bits(axis[1]), bits(axis[2])});
}

void write_item(BigEndianWriter& writer, std::uint32_t id, const Vec3f& p, const Quatf& q) {
  write_words(writer, std::array{id, bits(p[0]), bits(p[1]), bits(p[2]), bits(q[3]), bits(q[0]),
                                 bits(q[1]), bits(q[2])});
}

void write_segment(BigEndianWriter& writer, Type type, std::uint32_t id,
                   const SegmentPose& segment) {
  const Vec3f& p = segment.position_m;
  const Quatf q = segment.seen ? segment.rotation_xyzw : Quatf{};
  if (type == Type::kEuler) {
    const Vec3f turn = to_euler(segment.rotation_xyzw);
    write_words(writer,
                std::array{id, bits(p[0] * 100.0F), bits(p[1] * 100.0F), bits(p[2] * 100.0F),
                           bits(turn[0]), bits(turn[1]), bits(turn[2])});
  } else if (type == Type::kUnity) {
    write_item(writer, id, {-p[0], p[1], p[2]}, {q[0], -q[1], -q[2], q[3]});
  } else {
    const Vec3f axis = to_z_up({q[0], q[1], q[2]});
    write_item(writer, id, to_z_up(p), {axis[0], axis[1], axis[2], q[3]});
  }
}

// How a segment is turned from the one above it.
Quatf between(const SegmentPose& above, const SegmentPose& segment) {
  return from_eigen(to_eigen_double(above.rotation_xyzw).conjugate() *
                    to_eigen_double(segment.rotation_xyzw));
}

// A whole suit has 17 trackers: on all segments but the lower spine, the neck and the toes.
bool has_tracker(std::size_t segment) {
  constexpr std::array<std::size_t, 6> kWithout{1, 2, 3, 5, 18, 22};
  return std::ranges::find(kWithout, segment) == kWithout.end();
}

void write_text(BigEndianWriter& writer, std::string_view text) {
  writer.i32(static_cast<std::int32_t>(text.size()));
  writer.text(text);
}

}  // namespace

std::vector<std::byte> encode_datagram(const Head& head, std::span<const std::byte> payload) {
  const int type = static_cast<int>(head.type);
  BigEndianWriter writer;
  writer.written().reserve(kHeadBytes + payload.size());
  writer.text("MXTP");
  writer.u8(static_cast<std::uint8_t>('0' + type / kTextDigits));
  writer.u8(static_cast<std::uint8_t>('0' + type % kTextDigits));
  writer.u32(head.sample);
  writer.u8(static_cast<std::uint8_t>(head.part | (head.last ? 0x80 : 0)));
  writer.u8(head.items);
  writer.u32(head.time_ms);
  writer.u8(head.character);
  writer.u8(head.body);
  writer.u8(head.props);
  writer.u8(head.fingers);
  writer.u16(0);
  writer.u16(static_cast<std::uint16_t>(head.old ? 0 : payload.size()));
  writer.bytes(payload);
  return writer.finish();
}

std::vector<std::byte> encode_pose(Type type, const CharacterPose& pose) {
  const bool unity = type == Type::kUnity;
  const std::size_t count = pose.fingers && !unity ? kSegments : kBodySegments;
  BigEndianWriter writer;
  writer.written().reserve(count * item_bytes(type));
  for (std::size_t i = 0; i < count; ++i) {
    write_segment(writer, type, static_cast<std::uint32_t>(i + 1),
                  pose.segments.at(unity ? kUnitySegments.at(i) : i));
  }
  return writer.finish();
}

std::vector<std::byte> encode_meta(std::string_view name) {
  BigEndianWriter writer;
  write_text(writer, "color:3070d0\nname:" + std::string(name) + "\nxmid:00000000\n");
  return writer.finish();
}

std::vector<std::byte> encode_timecode(std::string_view text) {
  BigEndianWriter writer;
  write_text(writer, text);
  return writer.finish();
}

std::vector<std::byte> encode_scale(std::span<const Vec3f, kBodySegments> position_m) {
  BigEndianWriter writer;
  writer.i32(static_cast<std::int32_t>(kBodySegments));
  for (std::size_t i = 0; i < kBodySegments; ++i) {
    write_text(writer, segment_name(i));
    write_vector(writer, to_z_up(position_m[i]));
  }
  writer.i32(0);
  return writer.finish();
}

std::vector<std::byte> encode_values(Type type, const CharacterPose& pose) {
  BigEndianWriter writer;
  for (std::size_t i = 0; i < kBodySegments; ++i) {
    const bool joint = type == Type::kJointAngles;
    if (joint && parent_segment(i) < 0) continue;
    if (type == Type::kTrackers && !has_tracker(i)) continue;
    const std::size_t end = writer.size() + item_bytes(type);
    const auto id = static_cast<std::int32_t>(i + 1);
    if (joint) {
      const std::size_t parent = parent_segment(i);
      writer.i32(kPointsOfSegment * static_cast<std::int32_t>(parent + 1));
      writer.i32(kPointsOfSegment * id);
      write_vector(writer, to_z_up(to_euler(between(pose.segments[parent], pose.segments[i]))));
    } else {
      writer.i32(id);
      if (type == Type::kLinear) {
        write_vector(writer, to_z_up(pose.segments[i].position_m));
      } else {
        write_rotation(writer, pose.segments[i].rotation_xyzw);
      }
    }
    writer.bytes(std::vector<std::byte>(end - writer.size()));
  }
  return writer.finish();
}

std::vector<std::byte> encode_centre_of_mass(const Vec3f& position_m) {
  BigEndianWriter writer;
  write_vector(writer, to_z_up(position_m));
  return writer.finish();
}

std::vector<std::vector<std::byte>> encode_sample(const Head& head,
                                                  std::span<const std::byte> payload,
                                                  std::size_t longest) {
  const std::size_t item = item_bytes(head.type);
  const std::size_t per_part = std::max<std::size_t>(1, (longest - kHeadBytes) / item) * item;
  std::vector<std::vector<std::byte>> datagrams;
  for (std::size_t at = 0; at < payload.size(); at += per_part) {
    const auto piece = payload.subspan(at, std::min(per_part, payload.size() - at));
    Head part = head;
    part.part = static_cast<std::uint8_t>(datagrams.size());
    part.items = static_cast<std::uint8_t>(piece.size() / item);
    part.last = at + piece.size() == payload.size();
    datagrams.push_back(encode_datagram(part, piece));
  }
  return datagrams;
}

}  // namespace posed::drivers::mvn
