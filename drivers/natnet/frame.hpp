// Reads the payload of a NatNet frame: finds its parts and checks all counts and lengths before
// anything is taken out of it. The layout depends on the version; "from 3.0" means 3.0 and later.
//
//   i32 frame number
//   marker sets      { text name, markers }                     markers: i32 count, { f32[3] [m] }
//   other markers    { f32[3] [m] }
//   rigid bodies     { i32 id, f32[3] position [m], f32[4] rotation x y z w,
//                      before 3.0: i32 count, count f32[3] markers, count i32 ids, count f32 sizes,
//                      f32 mean error, from 2.6: i16 params (bit 0: tracked) }
//   skeletons        { i32 id, bones }                           bones: i32 count, { rigid body }
//   from 4.1         assets, skipped
//   from 2.3         labelled markers { i32 model << 16 | number, f32[3], f32 size [m],
//                      from 2.6: i16 params (bit 0: occluded), from 3.0: f32 residual }
//   from 2.9         force plates { i32 id, channels }           channels: i32 count, { i32 count,
//   from 2.11        devices, the same                                        count f32 }
//   from 4.1         perhaps more parts, skipped
//   before 3.0       f32 software latency [s]; what Motive 1.5 to 1.9 send there is the timestamp
//   u32 timecode (hours in the highest byte, minutes, seconds, frames), u32 its subframe
//   timestamp [s]    f64 from 2.7, f32 in 2.6
//   from 3.0         u64 ticks of camera mid-exposure, of receipt and of sending
//   from 4.1         u32 seconds, u32 fraction
//   from 2.6         i16 params (bit 1: the bodies have changed)
//   i32 0
//
// Each part is an i32 count and the entries in braces; from 4.1 an i32 with the bytes of all
// entries stands between them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/byte_reader.hpp"
#include "drivers/natnet/protocol.hpp"
#include "proto/frame/frame.hpp"

namespace posed::drivers::natnet {

// How to read frames: the version, and what the sources about it do not agree on. The reading that
// uses up a packet exactly is right.
struct Reading {
  Version version;
  bool bones_have_params = true;  // 2.6 to 2.8: the bones of skeletons may have none
  bool timestamp = true;          // 2.5: the packets of Motive 1.5 have none
  bool padded = false;            // 3.x: a word may follow the rotation of a rigid body

  bool operator==(const Reading&) const = default;
};

// All readings of a version, the likeliest first; of an unknown version those of all versions.
class Readings {
 public:
  explicit Readings(Version version) noexcept;
  [[nodiscard]] auto begin() const noexcept { return readings_.begin(); }
  [[nodiscard]] auto end() const noexcept {
    return readings_.begin() + static_cast<std::ptrdiff_t>(count_);
  }

 private:
  void add(Version version) noexcept;
  void put(const Reading& reading) noexcept { readings_[count_++] = reading; }

  std::array<Reading, 16> readings_{};
  std::size_t count_ = 0;
};

// The entries of a part, as they lie in the packet.
struct Entries {
  std::size_t count = 0;
  std::span<const std::byte> bytes{};
};

struct FrameView {
  std::uint32_t number = 0;
  Entries rigid_bodies{}, skeletons{}, labelled{};
  std::uint32_t timecode = 0;  // hours, minutes, seconds, frames, a byte each
  double timestamp_s = 0.0;
  std::uint64_t exposure_ticks = 0;  // 0 before 3.0
  bool bodies_changed = false;
};

// False when the payload does not fit the reading exactly.
RT_SAFE [[nodiscard]] bool read_frame(std::span<const std::byte> payload, const Reading& reading,
                                      FrameView& view) noexcept;

struct RigidBody {
  std::int32_t id = 0;
  Vec3f position_m{};
  Quatf rotation_xyzw{};
  bool tracked = true;
};

struct LabelledMarker {
  std::uint16_t model = 0;   // the body's id; 0: of none
  std::uint16_t number = 0;  // from 1
  Vec3f position_m{};
  bool occluded = false;
};

// Reads one entry; false when it is cut or its counts make no sense.
RT_SAFE [[nodiscard]] bool read_rigid_body(ByteReader& reader, const Reading& reading, bool is_bone,
                                           RigidBody& body) noexcept;
[[nodiscard]] bool read_labelled(ByteReader& reader, const Reading& reading,
                                 LabelledMarker& marker) noexcept;

}  // namespace posed::drivers::natnet
