#include "drivers/template_mocap/decoder.hpp"

#include "drivers/pose_values.hpp"
#include "drivers/template_mocap/protocol.hpp"

namespace posed::drivers::mocap {
namespace {

bool read_position(ByteReader& reader, Vec3f& position_m) noexcept {
  for (float& x_m : position_m) x_m = reader.f32();
  return is_plausible(position_m);
}

bool read_rotation(ByteReader& reader, Quatf& rotation, bool& seen) noexcept {
  for (float& x : rotation) x = reader.f32();
  return take_rotation(rotation, seen);
}

}  // namespace

// RT-safe.
void MocapDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                        Sink& sink) noexcept {
  Datagram datagram;
  Outcome outcome = decode_datagram(bytes, datagram);
  if (outcome == Outcome::kOk) {
    switch (datagram.kind) {
      case Kind::kRequest:
        outcome = Outcome::kForeign;  // another host's
        break;
      case Kind::kDescription:
        sink.description(datagram.content);
        break;
      case Kind::kFrame:
        outcome = take_frame(datagram.content, sink);
        break;
    }
  }
  sink.outcome(outcome);
}

// RT-safe.
Outcome MocapDecoder::take_frame(std::span<const std::byte> content, Sink& sink) noexcept {
  ByteReader reader(content);
  const std::uint32_t number = reader.u32();
  const std::uint32_t time_us = reader.u32();
  const std::size_t bodies = reader.u8();
  if (!reader.ok()) return Outcome::kShort;
  if (layout_ == nullptr) return Outcome::kForeign;  // the poll asks for a description
  if (const Outcome order = order_.take(number); order != Outcome::kOk) return order;
  const std::int64_t device_ns = clock_.to(time_us).ticks * 1000;
  taken_.reset();
  Outcome worst = Outcome::kOk;
  for (std::size_t i = 0; i < bodies; ++i) {
    const Outcome outcome = take_body(reader, device_ns, sink);
    if (outcome != Outcome::kOk) worst = outcome;
    if (outcome == Outcome::kShort) break;
  }
  return worst == Outcome::kOk && reader.left() != 0 ? Outcome::kShort : worst;
}

// RT-safe.
Outcome MocapDecoder::take_body(ByteReader& reader, std::int64_t device_ns, Sink& sink) noexcept {
  Frame frame;
  const std::uint16_t id = reader.u16();
  const std::size_t joints = reader.u8();
  bool sound = joints <= kMaxJoints && read_position(reader, frame.root_position_m);
  for (std::size_t j = 0; j < joints && joints <= kMaxJoints; ++j) {
    bool seen = false;
    sound = read_rotation(reader, frame.rotation_xyzw[j], seen) && sound;
    frame.valid[j] = seen;
  }
  // With too many joints the next body cannot be found.
  if (!reader.ok() || joints > kMaxJoints) return Outcome::kShort;
  const std::size_t body = layout_->body_of(id);
  if (!sound || body == layout_->bodies.size() || taken_[body]) return Outcome::kOutOfRange;
  const Skeleton& skeleton = *layout_->bodies[body].skeleton;
  if (joints != skeleton.joints.size()) return Outcome::kOutOfRange;
  taken_.set(body);
  frame.header.device_ns = device_ns;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(joints);
  sink.frame(body, frame);
  return Outcome::kOk;
}

}  // namespace posed::drivers::mocap
