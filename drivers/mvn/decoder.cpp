#include "drivers/mvn/decoder.hpp"

#include <algorithm>
#include <string_view>

#include "drivers/byte_reader.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::mvn {
namespace {

constexpr std::string_view kStart = "MXTP";

// Whether a datagram may begin here, as far as the bytes tell.
bool may_start(std::span<const std::byte> bytes) noexcept {
  const std::size_t known = std::min(bytes.size(), kStart.size());
  return std::ranges::equal(bytes.first(known), std::as_bytes(std::span(kStart)).first(known));
}

std::size_t until_start(std::span<const std::byte> bytes) noexcept {
  std::size_t at = 1;
  while (at < bytes.size() && !may_start(bytes.subspan(at))) ++at;
  return at;
}

constexpr std::int64_t kBetweenDescriptions_ns = 300'000'000;
constexpr std::size_t kTimeCodeBytes = 12;  // "HH:MM:SS.mmm"; closing bytes may follow

// The joints of a skeleton with or without fingers from the segments of a pose. A segment that was
// not seen moves with its parent.
RT_SAFE void fill_frame(const CharacterPose& pose, bool fingers, Frame& frame) noexcept {
  const JointTable& table = joint_table(fingers);
  std::array<Eigen::Quaterniond, kSegments> turned;  // [joint], in the room
  frame.joint_count = static_cast<std::uint16_t>(table.count);
  frame.root_position_m = pose.segments[0].position_m;
  for (std::size_t j = 0; j < table.count; ++j) {
    const std::size_t s = table.segment[j];
    const bool seen = pose.segments[s].seen && (s < kBodySegments || pose.fingers);
    const Eigen::Quaterniond above =
        j == 0 ? Eigen::Quaterniond::Identity() : turned[table.parent[j]];
    frame.valid[j] = seen;
    frame.rotation_xyzw[j] = kIdentity;
    turned[j] = above;
    if (!seen) continue;
    const Quatf& rotation = pose.segments[s].rotation_xyzw;
    frame.rotation_xyzw[j] = rotation;
    if (pose.local) continue;
    turned[j] = to_eigen_double(rotation);
    frame.rotation_xyzw[j] = from_eigen((above.conjugate() * turned[j]).normalized());
  }
}

}  // namespace

Framer::Next Framer::look(std::span<const std::byte> bytes) noexcept {
  if (!may_start(bytes)) return {.skip = until_start(bytes)};
  if (bytes.size() < kHeadBytes) return {};
  Head head;
  const bool valid = read_head(bytes, head) && head.payload_bytes <= kMaxPayload &&
                     is_right_size(head, head.payload_bytes);
  if (!valid) return {.skip = until_start(bytes)};
  const std::size_t whole = kHeadBytes + head.payload_bytes;
  if (bytes.size() < whole) return {};
  return {.whole = whole};
}

RT_SAFE void MvnDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                              Sink& sink) noexcept {
  now_ns_ = active_time_.to(arrival_ns);
  arrival_ns_ = arrival_ns;
  if (stream_) {
    framer_.feed(bytes, [&](std::span<const std::byte> datagram) noexcept {
      sink.outcome(datagram.empty() ? Outcome::kForeign : accept(datagram, sink));
      describe(sink);
    });
  } else {
    sink.outcome(accept(bytes, sink));
    describe(sink);
  }
}

RT_SAFE Outcome MvnDecoder::accept(std::span<const std::byte> bytes, Sink& sink) noexcept {
  Datagram datagram;
  const Outcome outcome = decode_datagram(bytes, datagram);
  if (outcome != Outcome::kOk) return outcome;
  switch (datagram.head.type) {
    case Type::kMeta:
      return accept_meta(datagram);
    case Type::kScale:
      return accept_scale(datagram);
    case Type::kTimeCode:
      return accept_timecode(datagram);
    default:
      return is_pose(datagram.head.type) ? accept_pose(datagram, sink)
                                         : accept_values(datagram, sink);
  }
}

RT_SAFE Outcome MvnDecoder::accept_pose(const Datagram& datagram, Sink& sink) noexcept {
  Tracked* tracked = find_or_add(datagram.head.character);
  if (tracked == nullptr) return Outcome::kOutOfRange;
  if (!tracked->prefers(datagram.head, arrival_ns_)) return Outcome::kOk;
  const Tracked::Part part = tracked->accept_part(datagram, gathered_);
  if (part.lost) sink.outcome(Outcome::kShort);  // stands for the part that did not come
  return part.whole ? accept_sample(*tracked, datagram.head, part.items, sink) : part.outcome;
}

RT_SAFE Outcome MvnDecoder::accept_sample(Tracked& tracked, const Head& head,
                                          std::span<const std::byte> items, Sink& sink) noexcept {
  const Outcome outcome = decode_pose(head, items, pose_);
  if (outcome != Outcome::kOk) return outcome;
  tracked.received_ns = now_ns_;
  tracked.look_at(pose_, now_ns_);
  const std::int64_t device_ns = device_time_ns(tracked, head);
  const std::size_t body = layout_ == nullptr ? 0 : layout_->body_of(head.character);
  if (layout_ == nullptr || body == layout_->bodies.size()) return Outcome::kForeign;
  Frame frame;
  fill_frame(pose_, layout_->entries[body].fingers, frame);
  frame.header.device_ns = device_ns;
  // It may come before or after the pose of its sample.
  if (head.sample - timecode_sample_ <= 1) frame.timecode = timecode_;
  frame.skeleton = layout_->bodies[body].skeleton->id;
  sink.frame(body, frame);
  return Outcome::kOk;
}

// Types 20 to 24.
RT_SAFE Outcome MvnDecoder::accept_values(const Datagram& datagram, Sink& sink) noexcept {
  Tracked* tracked = find(datagram.head.character);
  if (tracked == nullptr) return Outcome::kForeign;  // nobody with a pose
  const Outcome outcome = decode_values(datagram, values_);
  if (outcome != Outcome::kOk) return outcome;
  const auto group = static_cast<std::size_t>(values_.group);
  const Outcome order = tracked->value_order[group].accept(datagram.head);
  if (order != Outcome::kOk) return order;
  tracked->changed = tracked->changed || !tracked->character.values[group];
  tracked->character.values.set(group);
  const std::int64_t device_ns = device_time_ns(*tracked, datagram.head);
  const std::size_t body = layout_ == nullptr ? 0 : layout_->body_of(datagram.head.character);
  if (layout_ == nullptr || body == layout_->bodies.size()) return Outcome::kForeign;
  const MvnLayout::Entry& entry = layout_->entries[body];
  if (!entry.groups[group]) return Outcome::kForeign;  // until it is described
  const std::size_t begin = entry.values.begin[group];
  if (begin == ValuePlaces::kNone || values_.valid.none()) return Outcome::kOk;
  Sample sample;
  sample.header.device_ns = device_ns;
  sample.value_count = static_cast<std::uint16_t>(entry.values.count);
  for (std::size_t i = 0; i < value_count(values_.group); ++i) {
    sample.value[begin + i] = values_.valid[i] ? values_.value[i] : 0.0F;
    sample.valid[begin + i] = values_.valid[i];
  }
  sink.sample(body, sample);
  return Outcome::kOk;
}

RT_SAFE Outcome MvnDecoder::accept_timecode(const Datagram& datagram) noexcept {
  BigEndianReader reader(datagram.payload);
  const bool sized = datagram.payload[0] == std::byte{0};  // the text begins with a digit
  const std::size_t size = sized ? reader.u32() : reader.left();
  if (size > reader.left()) return Outcome::kShort;
  timecode_ = to_timecode(reader.text(std::min(size, kTimeCodeBytes)));
  timecode_sample_ = datagram.head.sample;
  return Outcome::kOk;
}

RT_SAFE Outcome MvnDecoder::accept_meta(const Datagram& datagram) noexcept {
  std::string_view name;
  const Outcome outcome = decode_meta(datagram.payload, name);
  if (outcome != Outcome::kOk || name.empty()) return outcome;
  Tracked* tracked = find_or_add(datagram.head.character);
  if (tracked == nullptr) return Outcome::kOutOfRange;
  tracked->set_name(name);
  return Outcome::kOk;
}

RT_SAFE Outcome MvnDecoder::accept_scale(const Datagram& datagram) noexcept {
  std::array<Vec3f, kBodySegments> position_m{};
  bool reported = false;
  const Outcome outcome = decode_scale(datagram.payload, position_m, reported);
  if (outcome != Outcome::kOk || !reported) return outcome;
  Tracked* tracked = find_or_add(datagram.head.character);
  if (tracked == nullptr) return Outcome::kOutOfRange;
  tracked->set_scale(position_m);
  return Outcome::kOk;
}

RT_SAFE Tracked* MvnDecoder::find(std::uint8_t character) noexcept {
  for (Tracked& tracked : characters_) {
    if (tracked.known && tracked.character.id == character) return &tracked;
  }
  return nullptr;
}

// Characters that are gone keep their slot, and so their name, until another one needs it.
RT_SAFE Tracked* MvnDecoder::find_or_add(std::uint8_t character) noexcept {
  if (Tracked* known = find(character); known != nullptr) return known;
  Tracked* room = nullptr;
  for (Tracked& tracked : characters_) {
    if (tracked.described) continue;
    const bool better = room == nullptr || (room->known && tracked.received_ns < room->received_ns);
    if (!tracked.known || better) room = &tracked;
    if (!tracked.known) break;
  }
  if (room != nullptr) room->begin(character, now_ns_);
  return room;
}

RT_SAFE std::int64_t MvnDecoder::device_time_ns(Tracked& tracked, const Head& head) noexcept {
  if (!tracked.clock.has_begun()) {
    const TimeCode* other = nullptr;
    for (const Tracked& each : characters_) {
      if (each.known && each.clock.has_begun()) other = &each.clock;
    }
    tracked.clock.begin(head.time_ms, other);
  }
  return tracked.clock.to_ns(head.time_ms);
}

// Describes the characters if they are others than before.
RT_SAFE void MvnDecoder::describe(Sink& sink) noexcept {
  if (described_ns_ != kNoTime_ns && now_ns_ - described_ns_ < kBetweenDescriptions_ns) return;
  bool due = false;
  std::size_t count = 0;
  for (Tracked& tracked : characters_) {
    if (!tracked.known) continue;
    const bool belongs = tracked.belongs(now_ns_);
    due = due || belongs != tracked.described || (belongs && tracked.changed);
    count += belongs ? 1 : 0;
    tracked.described = belongs;
  }
  if (!due) return;
  described_ns_ = now_ns_;
  std::size_t used = write_description_head(count, description_);
  // In the order of their numbers, so that who comes first changes nothing.
  for (std::size_t id = 0; id < 256; ++id) {
    Tracked* tracked = find(static_cast<std::uint8_t>(id));
    if (tracked == nullptr || !tracked->described) continue;
    tracked->changed = false;
    used += write_character(tracked->character, std::span(description_).subspan(used));
  }
  sink.description(std::span(description_).first(used));
}

}  // namespace posed::drivers::mvn
