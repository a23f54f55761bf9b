#include "drivers/natnet/frame.hpp"

namespace posed::drivers::natnet {
namespace {

constexpr std::size_t kMaxNatNetText = 256;  // bytes of a name in a frame
constexpr std::size_t kVectorBytes = 12;
// From 4.1, after the last part: timecode, timestamp, ticks, precise time, params, end.
constexpr std::size_t kSuffixBytes = 8 + 8 + 24 + 8 + 2 + 4;

bool skip(ByteReader& reader, std::size_t bytes) noexcept {
  static_cast<void>(reader.bytes(bytes));
  return reader.ok();
}

bool skip_text(ByteReader& reader) noexcept {
  for (std::size_t i = 0; i < kMaxNatNetText && reader.ok(); ++i) {
    if (reader.u8() == 0) return reader.ok();
  }
  return false;
}

// A count of entries that have at least `least` bytes each. False when there are not so many.
bool read_count(ByteReader& reader, std::size_t least, std::size_t& count) noexcept {
  const std::int32_t number = reader.i32();
  if (!reader.ok() || number < 0) return false;
  count = static_cast<std::size_t>(number);
  return count <= reader.left() / least;
}

bool skip_vectors(ByteReader& reader) noexcept {
  std::size_t count = 0;
  return read_count(reader, kVectorBytes, count) && skip(reader, count * kVectorBytes);
}

// A part whose entries `read_entry` reads. From 4.1 they must fill their part.
template <typename ReadEntry>
bool read_part(ByteReader& reader, Version version, std::size_t least, ReadEntry read_entry,
               Entries& entries) noexcept {
  const std::int32_t count = reader.i32();
  const bool sized = version >= Version{4, 1};
  const std::int32_t size = sized ? reader.i32() : 0;
  if (!reader.ok() || count < 0 || size < 0) return false;
  ByteReader inner = reader;
  const auto content = inner.bytes(sized ? static_cast<std::size_t>(size) : inner.left());
  entries.count = static_cast<std::size_t>(count);
  if (!inner.ok() || entries.count > content.size() / least) return false;
  ByteReader each(content);
  for (std::size_t i = 0; i < entries.count; ++i) {
    if (!read_entry(each)) return false;
  }
  if (sized && each.left() != 0) return false;
  entries.bytes = reader.bytes(content.size() - each.left());
  return reader.ok();
}

// A part that nobody here needs: skipped by its size, or entry by entry.
template <typename SkipEntry>
bool skip_part(ByteReader& reader, Version version, std::size_t least,
               SkipEntry skip_entry) noexcept {
  if (version < Version{4, 1}) {
    Entries ignored;
    return read_part(reader, version, least, skip_entry, ignored);
  }
  static_cast<void>(reader.i32());
  const std::int32_t size = reader.i32();
  return reader.ok() && size >= 0 && skip(reader, static_cast<std::size_t>(size));
}

bool skip_marker_set(ByteReader& reader) noexcept {
  return skip_text(reader) && skip_vectors(reader);
}

// An entry of the force plates and devices.
bool skip_channels(ByteReader& reader) noexcept {
  std::size_t channels = 0;
  if (!skip(reader, 4) || !read_count(reader, 4, channels)) return false;
  for (std::size_t i = 0; i < channels; ++i) {
    std::size_t values = 0;
    if (!read_count(reader, 4, values) || !skip(reader, 4 * values)) return false;
  }
  return true;
}

bool skip_skeleton(ByteReader& reader, const Reading& reading) noexcept {
  std::size_t bones = 0;
  if (!skip(reader, 4) || !read_count(reader, 32, bones)) return false;
  RigidBody ignored;
  for (std::size_t i = 0; i < bones; ++i) {
    if (!read_rigid_body(reader, reading, true, ignored)) return false;
  }
  return true;
}

bool read_parts(ByteReader& reader, const Reading& reading, FrameView& view) noexcept {
  const Version version = reading.version;
  const auto skip_vector = [](ByteReader& from) noexcept { return skip(from, kVectorBytes); };
  const auto rigid_body = [&](ByteReader& from) noexcept {
    RigidBody ignored;
    return read_rigid_body(from, reading, false, ignored);
  };
  const auto skeleton = [&](ByteReader& from) noexcept { return skip_skeleton(from, reading); };
  const auto labelled = [&](ByteReader& from) noexcept {
    LabelledMarker ignored;
    return read_labelled(from, reading, ignored);
  };
  if (!skip_part(reader, version, 5, skip_marker_set) ||
      !skip_part(reader, version, kVectorBytes, skip_vector) ||
      !read_part(reader, version, 32, rigid_body, view.rigid_bodies) ||
      !read_part(reader, version, 8, skeleton, view.skeletons)) {
    return false;
  }
  const bool sized = version >= Version{4, 1};
  if (sized && !skip_part(reader, version, 1, skip_channels)) return false;  // assets
  if (!read_part(reader, version, 20, labelled, view.labelled)) return false;
  if (version >= Version{2, 9} && !skip_part(reader, version, 8, skip_channels)) return false;
  if (version >= Version{2, 11} && !skip_part(reader, version, 8, skip_channels)) return false;
  while (sized && reader.left() > kSuffixBytes) {
    if (!skip_part(reader, version, 1, skip_channels)) return false;
  }
  return true;
}

bool read_suffix(ByteReader& reader, const Reading& reading, FrameView& view) noexcept {
  const Version version = reading.version;
  if (version < Version{3, 0}) view.timestamp_s = static_cast<double>(reader.f32());
  view.timecode = reader.u32();
  static_cast<void>(reader.u32());  // its subframe
  if (version >= Version{2, 7}) {
    view.timestamp_s = reader.f64();
  } else if (reading.timestamp) {
    view.timestamp_s = static_cast<double>(reader.f32());
  }
  if (version >= Version{3, 0}) {
    view.exposure_ticks = reader.u64();
    static_cast<void>(reader.bytes(16));
  }
  if (version >= Version{4, 1}) static_cast<void>(reader.bytes(8));
  if (version >= Version{2, 6}) view.bodies_changed = (reader.i16() & 2) != 0;
  const std::int32_t end = reader.i32();
  return reader.ok() && end == 0 && reader.left() == 0;
}

}  // namespace

Readings::Readings(Version version) noexcept {
  if (version.known()) {
    add(version);
    return;
  }
  // One version for each layout, the newest of those that are common first.
  constexpr std::array<Version, 7> kLayouts{
      {{3, 0}, {4, 1}, {2, 11}, {2, 9}, {2, 7}, {2, 6}, {2, 5}}};
  for (const Version one : kLayouts) add(one);
}

void Readings::add(Version version) noexcept {
  if (version < Version{2, 6}) put({.version = version, .timestamp = false});
  put({.version = version});
  if (version >= Version{2, 6} && version < Version{2, 9}) {
    put({.version = version, .bones_have_params = false});
  }
  if (version.major == 3) put({.version = version, .padded = true});
}

RT_SAFE bool read_frame(std::span<const std::byte> payload, const Reading& reading,
                        FrameView& view) noexcept {
  ByteReader reader(payload);
  view = {.number = reader.u32()};
  return read_parts(reader, reading, view) && read_suffix(reader, reading, view);
}

RT_SAFE bool read_rigid_body(ByteReader& reader, const Reading& reading, bool is_bone,
                             RigidBody& body) noexcept {
  const Version version = reading.version;
  body.id = reader.i32();
  for (float& x_m : body.position_m) x_m = reader.f32();
  for (float& x : body.rotation_xyzw) x = reader.f32();
  if (reading.padded) static_cast<void>(reader.u32());
  if (version < Version{3, 0}) {
    std::size_t markers = 0;
    constexpr std::size_t kMarkerBytes = kVectorBytes + 4 + 4;  // position, id, size
    if (!read_count(reader, kMarkerBytes, markers)) return false;
    if (!skip(reader, markers * kMarkerBytes)) return false;
  }
  static_cast<void>(reader.f32());  // mean error
  body.tracked = true;
  if (version >= Version{2, 6} && (!is_bone || reading.bones_have_params)) {
    body.tracked = (reader.i16() & 1) != 0;
  }
  return reader.ok();
}

RT_SAFE bool read_labelled(ByteReader& reader, const Reading& reading,
                           LabelledMarker& marker) noexcept {
  const std::uint32_t id = reader.u32();
  marker.model = static_cast<std::uint16_t>(id >> 16);
  marker.number = static_cast<std::uint16_t>(id & 0xffff);
  for (float& x_m : marker.position_m) x_m = reader.f32();
  static_cast<void>(reader.f32());  // size
  marker.occluded = reading.version >= Version{2, 6} && (reader.i16() & 1) != 0;
  if (reading.version >= Version{3, 0}) static_cast<void>(reader.f32());  // residual
  return reader.ok();
}

}  // namespace posed::drivers::natnet
