#include "drivers/rokoko/roster.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/rotation.hpp"

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

}  // namespace posed::drivers::rokoko
