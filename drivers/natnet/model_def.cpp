#include "drivers/natnet/model_def.hpp"

#include <utility>

#include "drivers/byte_reader.hpp"

namespace posed::drivers::natnet {
namespace {

constexpr std::size_t kMaxModelText = 1024;  // bytes of a name
// Size 2, origin 3, calibration matrix 12 * 12, corners 4 * 3, type, kind of data.
constexpr std::size_t kForcePlateWords = 2 + 3 + 144 + 12 + 2;

enum class Kind : std::int32_t {
  kMarkerSet = 0,
  kRigidBody = 1,
  kSkeleton = 2,
  kForcePlate = 3,
  kDevice = 4,
  kCamera = 5
};

// How to read it.
struct ModelReading {
  Version version;
  bool bones_have_markers = true;
};

std::vector<ModelReading> model_readings(Version likeliest) {
  std::vector<ModelReading> readings;
  const auto add = [&](Version version) {
    readings.push_back({.version = version});
    if (version >= Version{3, 0}) {
      readings.push_back({.version = version, .bones_have_markers = false});
    }
  };
  if (likeliest.known()) add(likeliest);
  for (const Version version :
       {Version{3, 0}, Version{4, 1}, Version{4, 2}, Version{4, 0}, Version{2, 9}}) {
    add(version);
  }
  return readings;
}

// Fills a ModelDef from one payload. Every function returns false for what does not fit.
class ModelReader {
 public:
  ModelReader(const ModelReading& reading, ModelDef& model) : reading_(reading), model_(model) {}

  [[nodiscard]] bool read(std::span<const std::byte> payload) {
    ByteReader reader(payload);
    const std::int32_t count = reader.i32();
    if (!reader.ok() || count < 0) return false;
    for (std::int32_t i = 0; i < count; ++i) {
      if (!read_entry(reader)) return false;
    }
    return reader.left() == 0;
  }

 private:
  bool read_entry(ByteReader& reader) {
    const auto kind = static_cast<Kind>(reader.i32());
    if (reading_.version < Version{4, 1}) return reader.ok() && read_kind(kind, reader, true);
    const std::int32_t size = reader.i32();
    if (!reader.ok() || size < 0) return false;
    const auto content = reader.bytes(static_cast<std::size_t>(size));
    if (!reader.ok()) return false;
    ByteReader inner(content);
    return read_kind(kind, inner, false);
  }

  // A kind that nobody needs may be left unread when its size is known.
  bool read_kind(Kind kind, ByteReader& reader, bool must_end) {
    switch (kind) {
      case Kind::kMarkerSet:
        return read_marker_set(reader) && (must_end || reader.left() == 0);
      case Kind::kRigidBody:
        return read_single(reader) && (must_end || reader.left() == 0);
      case Kind::kSkeleton:
        return read_skeleton(reader) && (must_end || reader.left() == 0);
      case Kind::kForcePlate:
        return !must_end || (skip(reader, 4) && skip_texts(reader, 1) &&
                             skip(reader, kForcePlateWords * 4) && skip_counted_texts(reader));
      case Kind::kDevice:
        return !must_end || (skip(reader, 4) && skip_texts(reader, 2) && skip(reader, 8) &&
                             skip_counted_texts(reader));
      case Kind::kCamera:
        return !must_end || (skip_texts(reader, 1) && skip(reader, 7 * 4));
    }
    return !must_end;
  }

  static bool skip(ByteReader& reader, std::size_t bytes) {
    static_cast<void>(reader.bytes(bytes));
    return reader.ok();
  }

  static bool read_text(ByteReader& reader, std::string& text) {
    text.clear();
    while (text.size() < kMaxModelText && reader.ok()) {
      const char letter = static_cast<char>(reader.u8());
      if (letter == '\0') return reader.ok();
      text.push_back(letter);
    }
    return false;
  }

  static bool skip_texts(ByteReader& reader, std::size_t count) {
    std::string ignored;
    for (std::size_t i = 0; i < count; ++i) {
      if (!read_text(reader, ignored)) return false;
    }
    return true;
  }

  static bool read_count(ByteReader& reader, std::size_t least, std::size_t& count) {
    const std::int32_t number = reader.i32();
    if (!reader.ok() || number < 0) return false;
    count = static_cast<std::size_t>(number);
    return count <= reader.left() / least;
  }

  static bool skip_counted_texts(ByteReader& reader) {
    std::size_t count = 0;
    return read_count(reader, 1, count) && skip_texts(reader, count);
  }

  bool read_marker_set(ByteReader& reader) {
    std::string name;
    std::size_t count = 0;
    if (!read_text(reader, name) || !read_count(reader, 1, count)) return false;
    model_.markers[name] = count;
    return skip_texts(reader, count);
  }

  bool read_bone(ByteReader& reader, bool has_markers, BoneDef& bone) {
    if (!read_text(reader, bone.name)) return false;
    bone.id = reader.i32();
    bone.parent = reader.i32();
    for (float& x_m : bone.offset_m) x_m = reader.f32();
    constexpr std::size_t kRotationBytes = 16;  // at rest; the frames do not count from there
    if (reading_.version >= Version{4, 2} && !skip(reader, kRotationBytes)) return false;
    if (!reader.ok()) return false;
    if (!has_markers || reading_.version < Version{3, 0}) return true;
    constexpr std::size_t kMarkerBytes = 12 + 4;  // position, label
    if (!read_count(reader, kMarkerBytes, bone.markers)) return false;
    if (!skip(reader, bone.markers * kMarkerBytes)) return false;
    return reading_.version < Version{4, 0} || skip_texts(reader, bone.markers);
  }

  bool read_single(ByteReader& reader) {
    BodyDef body;
    BoneDef& bone = body.bones.emplace_back();
    if (!read_bone(reader, true, bone)) return false;
    body.name = bone.name;
    body.id = bone.id;
    model_.bodies.push_back(std::move(body));
    return true;
  }

  bool read_skeleton(ByteReader& reader) {
    BodyDef body{.name = {}, .id = 0, .is_skeleton = true, .bones = {}};
    std::size_t count = 0;
    if (!read_text(reader, body.name)) return false;
    body.id = reader.i32();
    constexpr std::size_t kMinBoneBytes = 1 + 4 + 4 + 12;
    if (!read_count(reader, kMinBoneBytes, count)) return false;
    for (std::size_t i = 0; i < count; ++i) {
      if (!read_bone(reader, reading_.bones_have_markers, body.bones.emplace_back())) return false;
    }
    model_.bodies.push_back(std::move(body));
    return true;
  }

  const ModelReading& reading_;
  ModelDef& model_;
};

}  // namespace

Result<ModelDef> parse_model_def(std::span<const std::byte> payload, Version version) {
  for (const ModelReading& reading : model_readings(version)) {
    ModelDef model;
    if (ModelReader(reading, model).read(payload)) return model;
  }
  return fail(
      "the NatNet server's description of its bodies is cut or of a version that posed does not "
      "know; if it comes again, record a log and open an issue with it");
}

}  // namespace posed::drivers::natnet
