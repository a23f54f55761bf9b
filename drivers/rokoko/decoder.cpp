#include "drivers/rokoko/decoder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <lz4.h>
#include <xxhash.h>

#include "drivers/byte_reader.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::rokoko {
namespace {

// How far a joint may be from where the description has it: Studio's digits, a soft shoulder.
constexpr float kSameOffset_m = 0.005F;
constexpr float kSamePart = 0.02F;  // of the offset's length

// Returns the position of the joint in its parent's frame.
RT_SAFE Vec3f offset_in(const Subject& subject, std::size_t parent, std::size_t joint) noexcept {
  const auto place = [&subject](std::size_t j) {
    return Eigen::Map<const Eigen::Vector3f>(subject.position_m[j].data());
  };
  const Eigen::Vector3f offset =
      to_eigen(subject.rotation_xyzw[parent]).conjugate() * (place(joint) - place(parent));
  return {offset.x(), offset.y(), offset.z()};
}

RT_SAFE bool same_offset(const Vec3f& a, const Vec3f& b) noexcept {
  float apart = 0.0F;
  float length = 0.0F;
  for (std::size_t i = 0; i < 3; ++i) {
    apart += (a[i] - b[i]) * (a[i] - b[i]);
    length += b[i] * b[i];
  }
  return std::sqrt(apart) <= std::max(kSameOffset_m, kSamePart * std::sqrt(length));
}

// True if every joint of the frame lies where the description has it.
RT_SAFE bool same_proportions(const SeenBody& seen, const DescribedBody& body) noexcept {
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (!seen.joints[j] || !body.joints[j]) continue;
    const int parent = parent_among(body.joints, j);
    if (parent < 0 || !seen.joints[parent]) continue;
    const Vec3f offset = offset_in(*seen.subject, static_cast<std::size_t>(parent), j);
    if (!same_offset(offset, body.offset_m[j])) return false;
  }
  return true;
}

RT_SAFE SeenBody part_of(const Subject& subject, Part part, const JointSet& joints,
                         bool face) noexcept {
  return {.key = {.part = part, .name = subject.name},
          .joints = connected(joints),
          .face = face,
          .subject = &subject};
}

// The body's own name; Studio lets two props, or a prop and an actor, have the same.
std::string body_name(const BodyKey& key, const std::vector<Body>& before) {
  std::string name = key.name.empty() ? "unnamed" : clean(key.name.text());
  if (key.part == Part::kLeftHand) name += " left hand";
  if (key.part == Part::kRightHand) name += " right hand";
  const auto is_used = [&before](const std::string& wanted) {
    return std::ranges::find(before, wanted, &Body::name) != before.end();
  };
  if (!is_used(name)) return name;
  for (int number = 2;; ++number) {
    const std::string numbered = name + ' ' + std::to_string(number);
    if (!is_used(numbered)) return numbered;
  }
}

SampleLayout face_samples() {
  SampleLayout samples;
  for (std::size_t i = 0; i < kFaceValues; ++i) {
    samples.names.emplace_back(face_value_name(i));
    samples.units.emplace_back("1");
  }
  return samples;
}

// The checksum of LZ4 frames.
std::uint32_t xxh32_of(std::span<const std::byte> bytes) noexcept {
  return XXH32(bytes.data(), bytes.size(), 0);
}

constexpr std::uint32_t kMagicNumber = 0x184D2204;
constexpr std::size_t kMagicBytes = 4;
constexpr std::size_t kWindowBytes = 64 * 1024;  // how far back a block refers
constexpr std::uint32_t kStored = 0x80000000U;   // in a block's size: not compressed

// The bits of the head's first byte, and the largest size of a block by its second.
struct Lz4Head {
  bool linked = false, block_sums = false, content_sum = false, has_size = false;
  std::uint64_t size = 0;
  std::size_t block = 0;
};

RT_SAFE Outcome read_head(std::span<const std::byte> bytes, ByteReader& reader,
                          Lz4Head& head) noexcept {
  const unsigned flags = reader.u8();
  const unsigned sizes = reader.u8();
  head.linked = (flags & 0x20U) == 0;
  head.block_sums = (flags & 0x10U) != 0;
  head.has_size = (flags & 0x08U) != 0;
  head.content_sum = (flags & 0x04U) != 0;
  const unsigned step = sizes >> 4U & 7U;  // 4 to 7: 64 KB, 256 KB, 1 MB, 4 MB
  const bool known = flags >> 6U == 1 && (flags & 0x03U) == 0 && (sizes & 0x8FU) == 0 && step >= 4;
  if (reader.ok() && !known) return Outcome::kForeign;
  head.block = std::size_t{1} << (8U + 2U * step);
  if (head.has_size) head.size = reader.u64();
  const std::size_t covered = bytes.size() - kMagicBytes - reader.left();
  const std::uint8_t sum = reader.u8();
  if (!reader.ok()) return Outcome::kShort;
  const std::uint32_t expected = xxh32_of(bytes.subspan(kMagicBytes, covered));
  return sum == (expected >> 8U & 0xFFU) ? Outcome::kOk : Outcome::kBadChecksum;
}

// Puts one block behind the `used` bytes of the content.
RT_SAFE Outcome accept_block(const Lz4Head& head, std::span<const std::byte> block, bool stored,
                             std::span<std::byte> room, std::size_t& used) noexcept {
  const std::size_t most = std::min(head.block, room.size() - used);
  if (stored) {
    if (block.size() > head.block) return Outcome::kShort;
    if (block.size() > most) return Outcome::kOutOfRange;
    std::ranges::copy(block, room.begin() + static_cast<std::ptrdiff_t>(used));
    used += block.size();
    return Outcome::kOk;
  }
  const std::size_t before = head.linked ? std::min(used, kWindowBytes) : 0;
  char* const to = reinterpret_cast<char*>(room.data() + used);
  const int size = LZ4_decompress_safe_usingDict(
      reinterpret_cast<const char*>(block.data()), to, static_cast<int>(block.size()),
      static_cast<int>(most), to - before, static_cast<int>(before));
  // liblz4 does not say whether the block is damaged or too long.
  if (size < 0) return most < head.block ? Outcome::kOutOfRange : Outcome::kShort;
  used += static_cast<std::size_t>(size);
  return Outcome::kOk;
}

}  // namespace

RT_SAFE std::size_t bodies_of(const Subject& subject,
                              std::array<SeenBody, kMaxParts>& bodies) noexcept {
  std::size_t count = 0;
  const JointSet& joints = subject.turned;
  const JointSet left = fingers_of(kLeftHandJoint), right = fingers_of(kRightHandJoint);
  const bool face = subject.kind == Subject::Kind::kFace ||
                    (subject.has_face && subject.kind == Subject::Kind::kActor);
  const bool any_face = face && subject.face_seen.any();
  if (subject.kind == Subject::Kind::kNone) return 0;
  if (subject.kind == Subject::Kind::kProp) {
    if (joints[0]) bodies[count++] = part_of(subject, Part::kProp, joints, false);
    return count;
  }
  if (subject.has_body) {
    JointSet measured = joints;
    if (!subject.has_left_glove) measured &= ~left;
    if (!subject.has_right_glove) measured &= ~right;
    if (measured.any() || any_face) {
      bodies[count++] = part_of(subject, Part::kPerson, measured, any_face);
    }
    return count;
  }
  if (any_face) bodies[count++] = part_of(subject, Part::kPerson, {}, true);
  const auto add_hand = [&](bool worn, Part part, std::size_t hand, JointSet measured) {
    measured.set(hand);
    measured &= joints;
    if (worn && measured.any()) bodies[count++] = part_of(subject, part, measured, false);
  };
  add_hand(subject.has_left_glove, Part::kLeftHand, kLeftHandJoint, left);
  add_hand(subject.has_right_glove, Part::kRightHand, kRightHandJoint, right);
  return count;
}

RT_SAFE Roster::Entry* Roster::entry_of(const BodyKey& key) noexcept {
  Entry* free = nullptr;
  for (Entry& entry : entries_) {
    if (entry.used && entry.body.key == key) return &entry;
    if (!entry.used && free == nullptr) free = &entry;
  }
  return free;
}

RT_SAFE void Roster::measure(const SeenBody& seen, Entry& entry) noexcept {
  DescribedBody& body = entry.body;
  body.joints = seen.joints;
  body.face = body.face || seen.face;
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    const int parent = seen.joints[j] ? parent_among(seen.joints, j) : -1;
    if (parent >= 0) {
      body.offset_m[j] = offset_in(*seen.subject, static_cast<std::size_t>(parent), j);
    }
  }
  entry.differs = false;
  changed_ = true;
}

RT_SAFE bool Roster::accept(const SeenBody& body, std::int64_t arrival_ns) noexcept {
  Entry* const entry = entry_of(body.key);
  if (entry == nullptr) return false;
  if (!entry->used) {
    *entry = Entry{};
    entry->used = true;
    entry->body.key = body.key;
    measure(body, *entry);
  }
  entry->seen_ns = arrival_ns;
  if (body.face) entry->face_ns = arrival_ns;
  bool changed =
      body.face != entry->body.face && (body.face || arrival_ns - entry->face_ns > kSettled_ns);
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (body.joints[j]) {
      entry->joint_ns[j] = arrival_ns;
      changed = changed || !entry->body.joints[j];
    } else if (entry->body.joints[j]) {
      changed = changed || arrival_ns - entry->joint_ns[j] > kSettled_ns;
    }
  }
  const bool same = same_proportions(body, entry->body);
  if (!same && !entry->differs) entry->differs_ns = arrival_ns;
  entry->differs = !same;
  changed = changed || (!same && arrival_ns - entry->differs_ns > kSettled_ns);
  if (!changed) return true;
  entry->body.face = arrival_ns - entry->face_ns <= kSettled_ns && entry->body.face;
  measure(body, *entry);
  return true;
}

RT_SAFE std::span<const std::byte> Roster::describe(std::int64_t arrival_ns) noexcept {
  for (Entry& entry : entries_) {
    if (!entry.used || arrival_ns - entry.seen_ns <= kSettled_ns) continue;
    entry.used = false;
    changed_ = true;
  }
  const bool too_soon = described_ && arrival_ns - described_ns_ < kDescribeEvery_ns;
  if (!changed_ || too_soon) return {};
  changed_ = false;
  described_ = true;
  described_ns_ = arrival_ns;
  std::size_t used = 1;
  std::size_t count = 0;
  for (const Entry& entry : entries_) {
    if (!entry.used) continue;
    used += write_body(entry.body, std::span(bytes_).subspan(used));
    ++count;
  }
  bytes_[0] = static_cast<std::byte>(count);
  return std::span(bytes_).first(used);
}

Result<std::shared_ptr<const Skeleton>> skeleton_of(const DescribedBody& body,
                                                    const std::string& name) {
  if (body.joints.none()) return nullptr;
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = name;
  std::array<int, kStudioJoints> place{};
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (!body.joints[j]) continue;
    place[j] = static_cast<int>(skeleton->joints.size());
    Joint& joint = skeleton->joints.emplace_back();
    if (body.key.part == Part::kProp) {
      joint.name = "prop";
      continue;
    }
    const int parent = parent_among(body.joints, j);
    const Vec3f& offset_m = body.offset_m[j];
    joint.name = studio_joint(j).name;
    joint.parent = parent < 0 ? -1 : place[parent];
    joint.offset_m = {offset_m[0], offset_m[1], offset_m[2]};
    joint.bone = studio_joint(j).bone;
    joint.T_world_joint = to_eigen_double(t_pose_rotation(j));
  }
  TRY(skeleton->finish());
  return skeleton;
}

RT_SAFE std::size_t StudioLayout::body_of(const BodyKey& key) const noexcept {
  return std::ranges::find(plans, key, &BodyPlan::key) - plans.begin();
}

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto described = TRY(parse_description(description));
  auto layout = std::make_unique<StudioLayout>();
  for (const DescribedBody& body : described) {
    const std::string name = body_name(body.key, layout->bodies);
    auto skeleton = TRY(skeleton_of(body, name));
    layout->bodies.push_back({.name = name,
                              .skeleton = std::move(skeleton),
                              .samples = body.face ? face_samples() : SampleLayout{}});
    BodyPlan& plan = layout->plans.emplace_back();
    plan.key = body.key;
    plan.face = body.face;
    for (std::size_t j = 0; j < kStudioJoints; ++j) {
      if (body.joints[j]) plan.joint.push_back(static_cast<std::uint8_t>(j));
    }
  }
  return layout;
}

namespace {

// Sets the rotations relative to the parents. A joint that this frame does not have is not valid:
// it turns with its parent.
RT_SAFE void set_rotations(const BodyPlan& plan, const Skeleton& skeleton, const SeenBody& body,
                           Frame& frame) noexcept {
  std::array<Quatf, kMaxJoints> global{};
  for (std::size_t j = 0; j < plan.joint.size(); ++j) {
    const int parent = skeleton.joints[j].parent;
    const Quatf& around = parent < 0 ? kIdentity : global[parent];
    const bool seen = body.joints[plan.joint[j]];
    frame.valid[j] = seen;
    global[j] = seen ? body.subject->rotation_xyzw[plan.joint[j]] : around;
    frame.rotation_xyzw[j] =
        seen ? from_eigen((to_eigen(around).conjugate() * to_eigen(global[j])).normalized())
             : kIdentity;
  }
}

}  // namespace

RT_SAFE void StudioDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                                 Sink& sink) noexcept {
  Outcome outcome = read(bytes);
  if (outcome == Outcome::kOk) outcome = clock_.accept(frame_.timestamp_s);
  const std::int64_t active_ns = active_time_.to(arrival_ns);
  if (outcome == Outcome::kOk) outcome = accept_frame(active_ns, sink);
  sink.outcome(outcome);
}

RT_SAFE Outcome StudioDecoder::read(std::span<const std::byte> bytes) noexcept {
  if (is_lz4_frame(bytes)) {
    const Outcome outcome = decode_lz4_frame(bytes, json_, bytes);
    if (outcome != Outcome::kOk) return outcome;
  }
  const std::string_view json(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return read_studio_frame(json, frame_);
}

RT_SAFE Outcome StudioDecoder::accept_frame(std::int64_t active_ns, Sink& sink) noexcept {
  if (frame_.count == 0 && frame_.named_joints) {
    constexpr std::array kDescription{std::byte{kOnlyNamedJoints}};
    if (!std::exchange(told_named_joints_, true)) {
      sink.description(kDescription);
    } else if (const auto fewer = roster_.describe(active_ns); !fewer.empty()) {
      sink.description(fewer);
    }
    return Outcome::kOutOfRange;
  }
  Outcome worst = Outcome::kOk;
  std::array<SeenBody, kMaxParts> bodies;
  for (std::size_t i = 0; i < frame_.count; ++i) {
    const Subject& subject = frame_.subjects[i];
    const std::size_t count = subject.valid ? bodies_of(subject, bodies) : 0;
    if (!subject.valid) worst = Outcome::kOutOfRange;
    for (std::size_t k = 0; k < count; ++k) {
      if (!roster_.accept(bodies[k], active_ns)) worst = Outcome::kOutOfRange;
    }
  }
  const auto description = roster_.describe(active_ns);
  if (!description.empty()) sink.description(description);
  if (layout_ == nullptr) return frame_.count == 0 ? worst : Outcome::kForeign;
  taken_.reset();
  for (std::size_t i = 0; i < frame_.count; ++i) {
    const Subject& subject = frame_.subjects[i];
    const std::size_t count = subject.valid ? bodies_of(subject, bodies) : 0;
    for (std::size_t k = 0; k < count; ++k) {
      const Outcome one = emit(bodies[k], sink);
      if (worst == Outcome::kOk) worst = one;
    }
  }
  return worst;
}

RT_SAFE Outcome StudioDecoder::emit(const SeenBody& seen, Sink& sink) noexcept {
  const std::size_t body = layout_->body_of(seen.key);
  if (body == layout_->bodies.size()) return Outcome::kForeign;  // described, not yet in use
  if (taken_[body]) return Outcome::kOutOfRange;
  taken_.set(body);
  const BodyPlan& plan = layout_->plans[body];
  const Subject& subject = *seen.subject;
  if (plan.face && subject.face_seen.any()) emit_face(body, subject, sink);
  if (plan.joint.empty()) return Outcome::kOk;
  // Nothing but the root says where the body is.
  if (!subject.placed[plan.joint[0]]) return Outcome::kOutOfRange;
  const Skeleton& skeleton = *layout_->bodies[body].skeleton;
  Frame frame;
  frame.header.device_ns = clock_.device_ns();
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(plan.joint.size());
  frame.root_position_m = subject.position_m[plan.joint[0]];
  set_rotations(plan, skeleton, seen, frame);
  sink.frame(body, frame);
  return Outcome::kOk;
}

RT_SAFE void StudioDecoder::emit_face(std::size_t body, const Subject& subject,
                                      Sink& sink) noexcept {
  Sample sample;
  sample.header.device_ns = clock_.device_ns();
  sample.value_count = kFaceValues;
  for (std::size_t i = 0; i < kFaceValues; ++i) {
    sample.valid[i] = subject.face_seen[i];
    sample.value[i] = subject.face_seen[i] ? subject.face[i] : 0.0F;
  }
  sink.sample(body, sample);
}

RT_SAFE bool is_lz4_frame(std::span<const std::byte> bytes) noexcept {
  return ByteReader(bytes).u32() == kMagicNumber;
}

RT_SAFE Outcome decode_lz4_frame(std::span<const std::byte> bytes, std::span<std::byte> room,
                                 std::span<const std::byte>& content) noexcept {
  ByteReader reader(bytes);
  if (reader.u32() != kMagicNumber) return Outcome::kForeign;
  Lz4Head head;
  if (const Outcome outcome = read_head(bytes, reader, head); outcome != Outcome::kOk) {
    return outcome;
  }
  if (head.has_size && head.size > room.size()) return Outcome::kOutOfRange;
  std::size_t used = 0;
  for (;;) {
    const std::uint32_t word = reader.u32();
    if (!reader.ok()) return Outcome::kShort;
    if (word == 0) break;
    const auto block = reader.bytes(word & ~kStored);
    if (!reader.ok() || block.empty()) return Outcome::kShort;
    if (head.block_sums && reader.u32() != xxh32_of(block)) {
      return reader.ok() ? Outcome::kBadChecksum : Outcome::kShort;
    }
    const Outcome outcome = accept_block(head, block, (word & kStored) != 0, room, used);
    if (outcome != Outcome::kOk) return outcome;
  }
  content = room.first(used);
  if (head.content_sum && reader.u32() != xxh32_of(content)) {
    return reader.ok() ? Outcome::kBadChecksum : Outcome::kShort;
  }
  const bool whole = reader.ok() && reader.left() == 0;
  return whole && (!head.has_size || head.size == used) ? Outcome::kOk : Outcome::kShort;
}

}  // namespace posed::drivers::rokoko
