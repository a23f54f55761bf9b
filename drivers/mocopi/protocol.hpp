// The datagrams of Sony's mocopi app ("mocopi (UDP)"), as two public descriptions of observed
// packets tell them: seagetch/mcp-receiver (doc/Protocol.md) and
// t-34400/mocopi_protocol_supplement. Sony publishes the bones, not the bytes; nothing here was
// compared with a real capture. No I/O.
//
// Everything is a field; fields lie inside fields. All numbers are little-endian.
//
//   +--------------+--------------+------------------------+
//   | length (u32) | name, 4 char | value: `length` bytes  |
//   +--------------+--------------+------------------------+
//
//   head { ftyp "sony motion format", vrsn u8 = 1 }
//   sndf { ipad 8 bytes, rcvp u16 }                     sender; not used
//   and one of
//   skdf { bons { bndt { bnid u16, pbid u16, tran 7 x f32 } ... } }      every few seconds
//   fram { fnum u32, time f32 [s], uttm f64 [s, Unix time; newer apps],
//          btrs { btdt { bnid u16, tran 7 x f32 } ... } }
//
//   bnid, pbid   a bone and its parent, 0 to 26 (bone_name); the root's parent is no bone
//   tran         rotation x, y, z, w and position x, y, z [m], relative to the parent
//
// Axes: right-handed, Y up, facing +Z with the left hand at +X, because Sony's plugin for Unity
// mirrors X: as in posed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/byte_reader.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::mocopi {

inline constexpr std::string_view kFormat = "sony motion format";
inline constexpr std::uint8_t kFormatVersion = 1;

// Reads the fields of a value one by one.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> bytes) noexcept : reader_(bytes) {}
  // False at the end, and when a field is longer than what is left.
  RT_SAFE [[nodiscard]] bool next(std::string_view& name,
                                  std::span<const std::byte>& value) noexcept;
  // Every field fitted.
  RT_SAFE [[nodiscard]] bool ok() const noexcept { return reader_.ok(); }

 private:
  ByteReader reader_;
};

struct Transform {
  Quatf rotation_xyzw = kIdentity;
  Vec3f position_m{};
};

enum class Kind : std::uint8_t { kSkeleton, kFrame };
struct Datagram {
  Kind kind = Kind::kFrame;
  std::span<const std::byte> content;  // of skdf or fram
};

// kForeign: not mocopi's, or of another version. kShort: cut, or a field that does not fit.
RT_SAFE [[nodiscard]] Outcome decode_datagram(std::span<const std::byte> bytes,
                                              Datagram& datagram) noexcept;

struct BoneEntry {
  std::uint16_t id = 0, parent = 0;
  Transform transform{};
};

// One bndt or btdt; false when a field is missing or has the wrong size.
RT_SAFE [[nodiscard]] bool read_bone(std::span<const std::byte> value, bool with_parent,
                                     BoneEntry& bone) noexcept;

struct FrameHead {
  std::uint32_t number = 0;
  double unix_s = 0.0;  // NaN when the app does not send it
  std::span<const std::byte> bones;
};
[[nodiscard]] bool read_frame(std::span<const std::byte> content, FrameHead& head) noexcept;

// The bones of a skdf, which is untrusted: at most kMaxJoints, no number twice. Cold.
Result<std::vector<BoneEntry>> parse_skeleton(std::span<const std::byte> content);

inline constexpr std::size_t kBones = 27;
inline constexpr std::uint16_t kNoParent = 0xFFFF;
// Sony's name of a bone, and which bone of the canonical humanoid it is. Cold.
[[nodiscard]] std::string bone_name(std::uint16_t id);
[[nodiscard]] std::optional<Bone> canonical_bone(std::uint16_t id);
// The parent in Sony's technical specification. Cold.
[[nodiscard]] std::uint16_t usual_parent(std::uint16_t id);

}  // namespace posed::drivers::mocopi
