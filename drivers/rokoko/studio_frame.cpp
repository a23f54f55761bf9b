#include "drivers/rokoko/studio_frame.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "drivers/json_reader.hpp"
#include "drivers/pose_values.hpp"

namespace posed::drivers::rokoko {
namespace {

constexpr double kMaxFloat = std::numeric_limits<float>::max();
constexpr double kRotationTolerance = 1e-2;  // of the squared length: some senders round to digits
constexpr double kMaxFaceValue = 10.0;       // 1 is a fully open jaw; exaggeration stays below 2
constexpr double kFaceUnits = 100.0;         // Studio counts to 100, ARKit to 1

// A cast of a double beyond a float's range is undefined.
RT_SAFE float narrowed(double value) noexcept {
  return std::abs(value) <= kMaxFloat ? static_cast<float>(value)
                                      : std::numeric_limits<float>::quiet_NaN();
}

// {"x": 1, "y": 2, ...} into the values; true if all of them were there.
template <std::size_t count>
RT_SAFE bool read_vector(JsonReader& json, std::array<float, count>& values) noexcept {
  constexpr std::string_view kLetters = "xyzw";
  unsigned seen = 0;
  if (!json.enter_object()) return false;
  for (std::string_view key; json.next(key);) {
    const std::size_t i = key.size() == 1 ? kLetters.find(key[0]) : std::string_view::npos;
    double value = 0.0;
    if (i >= count) {
      json.skip();
    } else if (json.number(value)) {
      values[i] = narrowed(value);
      seen |= 1U << i;
    }
  }
  return json.ok() && seen == (1U << count) - 1;
}

// The joint's place and rotation, by the members of a joint or prop. RT-safe.
struct Transform {
  Vec3f position_m{};
  Quatf rotation_xyzw{};
  bool placed = false, turned = false;

  // True if the member is one of its own; it is taken.
  bool accept(JsonReader& json, std::string_view key) noexcept {
    if (key == "position") {
      placed = read_vector(json, position_m);
      return true;
    }
    if (key != "rotation") return false;
    turned = read_vector(json, rotation_xyzw);
    return true;
  }
};

RT_SAFE void keep(const Transform& transform, std::size_t joint, Subject& subject) noexcept {
  if (!transform.placed) return;  // as if it had not been sent
  if (subject.placed[joint]) subject.valid = false;
  subject.placed.set(joint);
  subject.position_m[joint] = mirrored(transform.position_m);
  subject.valid = subject.valid && is_plausible(transform.position_m);
  Quatf rotation = transform.rotation_xyzw;
  bool seen = false;
  if (!transform.turned) return;
  subject.valid = accept_rotation(rotation, seen, kRotationTolerance) && subject.valid;
  subject.turned[joint] = seen;
  subject.rotation_xyzw[joint] = mirrored(rotation);
}

RT_SAFE void read_joint(JsonReader& json, std::size_t joint, Subject& subject) noexcept {
  Transform transform;
  if (!json.enter_object()) return;
  for (std::string_view key; json.next(key);) {
    if (!transform.accept(json, key)) json.skip();
  }
  keep(transform, joint, subject);
}

RT_SAFE void read_name(JsonReader& json, StudioName& name) noexcept {
  std::string_view raw;
  if (json.text(raw)) name.set(raw);
}

RT_SAFE void read_meta(JsonReader& json, Subject& subject) noexcept {
  bool any_glove = true;
  if (!json.enter_object()) return;
  for (std::string_view key; json.next(key);) {
    if (key == "hasBody") {
      static_cast<void>(json.boolean(subject.has_body));
    } else if (key == "hasLeftGlove") {
      static_cast<void>(json.boolean(subject.has_left_glove));
    } else if (key == "hasRightGlove") {
      static_cast<void>(json.boolean(subject.has_right_glove));
    } else if (key == "hasGloves") {
      static_cast<void>(json.boolean(any_glove));
    } else if (key == "hasFace") {
      static_cast<void>(json.boolean(subject.has_face));
    } else {
      json.skip();
    }
  }
  subject.has_left_glove = subject.has_left_glove && any_glove;
  subject.has_right_glove = subject.has_right_glove && any_glove;
}

// Reads a face, which an actor has (version 3) or the list of faces (version 2).
RT_SAFE void read_face(JsonReader& json, Subject& subject, bool alone) noexcept {
  if (!json.enter_object()) return;
  for (std::string_view key; json.next(key);) {
    const std::size_t i = face_value_named(key);
    double value = 0.0;
    if (i < kFaceValues) {
      if (!json.number(value)) continue;
      subject.face[i] = narrowed(value / kFaceUnits);
      subject.face_seen[i] = std::abs(value / kFaceUnits) <= kMaxFaceValue;  // false for NaN
    } else if (alone && key == "faceId") {
      read_name(json, subject.name);
    } else if (alone && key == "profileName") {
      read_name(json, subject.profile);
    } else {
      json.skip();
    }
  }
}

RT_SAFE void read_body(JsonReader& json, Subject& subject) noexcept {
  if (!json.enter_object()) return;
  for (std::string_view key; json.next(key);) {
    const std::size_t joint = joint_named(key);
    if (joint < kStudioJoints) {
      read_joint(json, joint, subject);
    } else {
      json.skip();
    }
  }
}

RT_SAFE void read_actor(JsonReader& json, Subject& subject) noexcept {
  if (!json.enter_object()) return;
  for (std::string_view key; json.next(key);) {
    const std::size_t joint = joint_named(key);
    if (key == "name") {
      read_name(json, subject.name);
    } else if (key == "profileName") {
      read_name(json, subject.profile);
    } else if (key == "meta") {
      read_meta(json, subject);
    } else if (key == "body") {
      read_body(json, subject);
    } else if (key == "face") {
      read_face(json, subject, false);
    } else if (joint < kStudioJoints) {
      read_joint(json, joint, subject);
    } else {
      json.skip();
    }
  }
}

RT_SAFE void read_prop(JsonReader& json, Subject& subject) noexcept {
  Transform transform;
  if (!json.enter_object()) return;
  for (std::string_view key; json.next(key);) {
    if (key == "name") {
      read_name(json, subject.name);
    } else if (!transform.accept(json, key)) {
      json.skip();
    }
  }
  keep(transform, 0, subject);
}

// Reads a list of subjects; false when there are too many.
RT_SAFE bool read_list(JsonReader& json, Subject::Kind kind, StudioFrame& frame) noexcept {
  if (!json.enter_array()) return true;
  while (json.next()) {
    if (frame.count == kMaxSubjects) return false;
    Subject& subject = frame.subjects[frame.count++];
    subject.kind = kind;
    subject.name.clear();
    subject.profile.clear();
    subject.has_body = subject.has_left_glove = subject.has_right_glove = subject.has_face = true;
    subject.valid = true;
    subject.placed.reset();
    subject.turned.reset();
    subject.face_seen.reset();
    if (kind == Subject::Kind::kActor) read_actor(json, subject);
    if (kind == Subject::Kind::kProp) read_prop(json, subject);
    if (kind == Subject::Kind::kFace) read_face(json, subject, true);
  }
  return true;
}

// A member of "scene" (version 3) or of the whole (version 2). False when there are too many
// subjects.
RT_SAFE bool read_member(JsonReader& json, std::string_view key, StudioFrame& frame) noexcept {
  if (key == "actors") return read_list(json, Subject::Kind::kActor, frame);
  if (key == "props" || key == "trackers") return read_list(json, Subject::Kind::kProp, frame);
  if (key == "faces") return read_list(json, Subject::Kind::kFace, frame);
  if (key == "newtons" || key == "characters") {
    if (!json.enter_array()) return true;
    for (; json.next(); json.skip()) frame.named_joints = true;
  } else if (key != "timestamp") {
    json.skip();
  } else if (!json.number(frame.timestamp_s)) {
    frame.timestamp_s = std::numeric_limits<double>::quiet_NaN();
  }
  return true;
}

// 3, 2.5 or "3.0"; 0 when it is none of them.
RT_SAFE double read_version(JsonReader& json) noexcept {
  double version = 0.0;
  JsonReader as_number = json;
  if (as_number.number(version)) {
    json = as_number;
    return version;
  }
  std::string_view words;
  if (!json.text(words)) return 0.0;
  JsonReader within(words);
  return within.number(version) ? version : 0.0;
}

// The faces of version 2 become those of the actors with the same profile.
RT_SAFE void join_faces(StudioFrame& frame) noexcept {
  for (std::size_t i = 0; i < frame.count; ++i) {
    Subject& face = frame.subjects[i];
    if (face.kind != Subject::Kind::kFace || face.profile.empty()) continue;
    for (std::size_t k = 0; k < frame.count; ++k) {
      Subject& actor = frame.subjects[k];
      const bool same = actor.profile == face.profile || actor.name == face.profile;
      if (actor.kind != Subject::Kind::kActor || !same) continue;
      actor.face = face.face;
      actor.face_seen = face.face_seen;
      face.kind = Subject::Kind::kNone;
      break;
    }
  }
}

// Studio lets two actors, or two props, have one name: the second "Anna" becomes "Anna 2".
RT_SAFE void tell_apart(StudioFrame& frame) noexcept {
  for (std::size_t k = 1; k < frame.count; ++k) {
    Subject& subject = frame.subjects[k];
    const StudioName own = subject.name;
    const auto is_taken = [&](const Subject& other) {
      return other.kind == subject.kind && other.name == subject.name;
    };
    const auto before = std::span(frame.subjects).first(k);
    for (int number = 2; std::ranges::any_of(before, is_taken); ++number) {
      subject.name = own;
      subject.name.add_number(number);
    }
  }
}

}  // namespace

RT_SAFE void StudioName::add_number(int number) noexcept {
  constexpr std::size_t kMaxDigits = 11;
  std::array<char, kMaxDigits> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  const auto count = static_cast<std::size_t>(end - digits.data());
  const std::size_t room = bytes_.size() - count - 1;
  if (size_ > room) {
    for (size_ = room; size_ > 0 && (bytes_[size_] & 0xC0) == 0x80;) --size_;  // whole letters
  }
  bytes_[size_++] = ' ';
  std::ranges::copy(std::string_view(digits.data(), count), bytes_.begin() + size_);
  size_ += count;
}

RT_SAFE void StudioName::set(std::string_view raw) noexcept { size_ = unescape_json(raw, bytes_); }

RT_SAFE void StudioName::keep(std::string_view text) noexcept {
  size_ = std::min(text.size(), bytes_.size());
  std::ranges::copy(text.substr(0, size_), bytes_.begin());
}

RT_SAFE Outcome read_studio_frame(std::string_view json, StudioFrame& frame) noexcept {
  JsonReader reader(json);
  frame.count = 0;
  frame.named_joints = false;
  frame.timestamp_s = std::numeric_limits<double>::quiet_NaN();
  bool room = true;
  double version = 0.0;
  if (!reader.enter_object()) return Outcome::kForeign;
  for (std::string_view key; room && reader.next(key);) {
    if (key == "version") {
      version = read_version(reader);
    } else if (key != "scene") {
      room = read_member(reader, key, frame);
    } else if (reader.enter_object()) {
      while (room && reader.next(key)) room = read_member(reader, key, frame);
    }
  }
  if (!room || reader.fault() == JsonReader::Fault::kDeep) return Outcome::kOutOfRange;
  if (!reader.ok()) return Outcome::kShort;
  if (!(version >= 2.0)) return Outcome::kForeign;
  if (!reader.at_end()) return Outcome::kShort;
  join_faces(frame);
  tell_apart(frame);
  return Outcome::kOk;
}

}  // namespace posed::drivers::rokoko
