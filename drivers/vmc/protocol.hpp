// The part of the VMC protocol that posed uses (https://protocol.vmc.info, version 3.1): its
// addresses, the limits of its names, and the description that the decoder writes itself, because
// the protocol has none.
//
// A description of the performer, little-endian:
//
//     0           1               ...
//   +-----------+------------+-------+-----------+-------------------------+
//   | version 1 | title size | title | bones (u8)| each: bone, x, y, z     |
//   +-----------+------------+-------+-----------+-------------------------+
//   | values (u8)| each: kind (u8), name size, name                        |
//   +------------+---------------------------------------------------------+
//    title      u8, 0 to 127 bytes: what /VMC/Ext/VRM calls the avatar
//    bone       u8, index in bone_table(), ascending
//    x, y, z    3 x f32 [m], from the nearest parent that is sent, in posed's axes
//    kind       0 blend shape, 1 head set, 2 controller, 3 tracker
//    name size  u8, 1 to 127: of the blend shape, or the device's serial number
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/vmc/bones.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::vmc {

inline constexpr std::string_view kAddressPrefix = "/VMC/";

inline constexpr std::size_t kMaxVmcName = 127;  // bytes of a name; longer ones are not used

enum class ValueKind : std::uint8_t { kBlend, kHeadSet, kController, kTracker };
inline constexpr std::size_t kValueKinds = 4;

// A blend shape is one value of a Sample; a device has seven, its position and its rotation.
[[nodiscard]] constexpr std::size_t values_of(ValueKind kind) noexcept {
  return kind == ValueKind::kBlend ? 1 : 7;
}

// The address that carries it.
[[nodiscard]] constexpr const char* address_of(ValueKind kind) noexcept {
  constexpr std::array<const char*, kValueKinds> kAddresses{
      "/VMC/Ext/Blend/Val", "/VMC/Ext/Hmd/Pos", "/VMC/Ext/Con/Pos", "/VMC/Ext/Tra/Pos"};
  return kAddresses[static_cast<std::size_t>(kind)];
}

// The most values of a performer's Sample: far more than the blend shapes of an avatar and the
// devices of a person. The description's byte counts its entries, of which a device has seven
// values.
inline constexpr std::size_t kMaxVmcValues = 128;
static_assert(kMaxVmcValues <= 255 && kMaxVmcValues <= kMaxSampleValues);

// A description; its texts are views.
struct Described {
  struct Value {
    ValueKind kind{};
    std::string_view name;
  };
  std::string_view title;
  std::bitset<kBoneCount> bones;
  std::array<Vec3f, kBoneCount> offset_m{};  // [bone]
  std::array<Value, kMaxVmcValues> values{};
  std::size_t value_count = 0;  // entries of `values`
};
inline constexpr std::size_t kMaxDescribed =
    4 + kMaxVmcName + kBoneCount * 13 + kMaxVmcValues * (2 + kMaxVmcName);

// The bytes of a description, written into `room`. Title and names have at most kMaxVmcName bytes,
// names at least one; `value_count` is at most kMaxVmcValues.
RT_SAFE [[nodiscard]] std::span<const std::byte> write_description(
    const Described& described, std::array<std::byte, kMaxDescribed>& room) noexcept;

// The description in these bytes, which are untrusted; its texts are views of them. Names are not
// checked for being text. Cold.
Result<Described> parse_description(std::span<const std::byte> bytes);

}  // namespace posed::drivers::vmc
