#include "drivers/template_mocap/decoder.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/template_mocap/protocol.hpp"
#include "proto/frame/plausible.hpp"

namespace posed::drivers::mocap {
namespace {

// The network delivers a frame at most this late; one that is further behind, or many in a row, are
// those of a restarted device.
constexpr std::uint32_t kMaxLate = 15;  // frames
constexpr int kMaxLateInARow = 3;
// Deviation of a rotation's squared length from 1 that rounding explains.
constexpr double kTolerance = 1e-3;

bool read_position(ByteReader& reader, Vec3f& position_m) noexcept {
  bool near = true;
  for (float& x_m : position_m) {
    x_m = reader.f32();
    near = near && std::abs(static_cast<double>(x_m)) <= kMaxPosition_m;  // false for NaN
  }
  return near;
}

// Returns false for what is no rotation; all zero means that the joint was not seen.
bool read_rotation(ByteReader& reader, Quatf& rotation, bool& seen) noexcept {
  double squared = 0.0;
  for (float& x : rotation) {
    x = reader.f32();
    squared += static_cast<double>(x) * static_cast<double>(x);
  }
  seen = squared != 0.0;
  if (!seen) rotation = kIdentity;
  if (!seen) return true;
  if (!(std::abs(squared - 1.0) <= kTolerance)) return false;
  const double length = std::sqrt(squared);
  for (float& x : rotation) x = static_cast<float>(static_cast<double>(x) / length);
  return true;
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
bool MocapDecoder::is_new(std::uint32_t number) noexcept {
  const bool late = has_number_ && number_ - number <= kMaxLate;  // numbers wrap
  if (late && ++late_ <= kMaxLateInARow) return false;
  late_ = 0;
  has_number_ = true;
  number_ = number;
  return true;
}

// RT-safe.
Outcome MocapDecoder::take_frame(std::span<const std::byte> content, Sink& sink) noexcept {
  ByteReader reader(content);
  const std::uint32_t number = reader.u32();
  const std::uint32_t time_us = reader.u32();
  const std::size_t bodies = reader.u8();
  if (!reader.ok()) return Outcome::kShort;
  if (layout_ == nullptr) return Outcome::kForeign;  // the poll asks for a description
  if (!is_new(number)) return Outcome::kOutOfRange;
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
