#include "drivers/mocopi/decoder.hpp"

#include <bitset>

#include "drivers/pose_values.hpp"

namespace posed::drivers::mocopi {
namespace {

constexpr double kLooseLength = 1e-2;  // of the squared length of a rotation

// Puts one bone of a frame in its place; false when it contradicts the layout. RT-safe.
bool accept_bone(const BoneEntry& bone, const MocopiLayout& layout, std::bitset<kMaxJoints>& taken,
                 Frame& frame) noexcept {
  const std::size_t joint = layout.joint_of(bone.id);
  if (joint == layout.id.size() || taken[joint]) return false;
  taken.set(joint);
  Quatf rotation = bone.transform.rotation_xyzw;
  bool seen = false;
  if (!accept_rotation(rotation, seen, kLooseLength)) return false;
  if (!is_plausible(bone.transform.position_m)) return false;
  frame.rotation_xyzw[joint] = rotation;
  frame.valid[joint] = seen;
  if (joint == 0) frame.root_position_m = bone.transform.position_m;
  return true;
}

}  // namespace

// RT-safe.
void MocopiDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                         Sink& sink) noexcept {
  Datagram datagram;
  Outcome outcome = decode_datagram(bytes, datagram);
  if (outcome == Outcome::kOk && datagram.kind == Kind::kSkeleton) {
    sink.description(datagram.content);
  } else if (outcome == Outcome::kOk) {
    outcome = accept_frame(datagram.content, sink);
  }
  sink.outcome(outcome);
}

// RT-safe.
Outcome MocopiDecoder::accept_frame(std::span<const std::byte> content, Sink& sink) noexcept {
  FrameHead head;
  if (!read_frame(content, head)) return Outcome::kShort;
  if (layout_ == nullptr) return Outcome::kForeign;
  if (const Outcome order = order_.accept(head.number); order != Outcome::kOk) return order;
  // The frame number says what is new; a wall clock that was set back only stops the time.
  static_cast<void>(clock_.accept(head.unix_s));
  Frame frame;
  const Skeleton& skeleton = *layout_->bodies[0].skeleton;
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) frame.rotation_xyzw[j] = kIdentity;
  frame.header.device_ns = clock_.device_ns();
  std::bitset<kMaxJoints> taken;
  FieldReader fields(head.bones);
  std::string_view name;
  std::span<const std::byte> value;
  while (fields.next(name, value)) {
    BoneEntry bone;
    if (name != "btdt") continue;
    if (!read_bone(value, false, bone)) return Outcome::kShort;
    if (!accept_bone(bone, *layout_, taken, frame)) return Outcome::kOutOfRange;
  }
  if (!fields.ok()) return Outcome::kShort;
  if (!taken[0]) return Outcome::kOutOfRange;  // nothing says where the body is
  sink.frame(0, frame);
  return Outcome::kOk;
}

}  // namespace posed::drivers::mocopi
