// The reports of the Essential Reality P5, a USB glove with five bends and eight LEDs that two
// camera heads in its rig see. No I/O here.
//
// Input report, 24 bytes; bits counted from the most significant one of byte 0:
//     0 ..   7   01
//     8 ..  37   bends of index, middle, ring, little, thumb: 5 x 6 bits, 63 is clenched
//    40 ..  43   buttons: 1 A, 2 B, 4 C
//    44 ..  59   4 x 4 bits: the LED of each measurement; 8 or more: no measurement
//    60 .. 179   4 x (v2, v1, h), each 10 bits, signed: the LED in the upper and lower head
//   180 .. 191   unused
//   Measurements really go from -615 to 615 and wrap.
// Feature reports, read once:
//    6   06 v0 h0 v1 h1 d    heads' corrections, i8 in 1/32 degree; their distance in 1/10 inch
//    9   09 major minor      firmware
//   12   0C type, then 10 LEDs x 3 x i16 BE in 1/100 inch, x negated     62 bytes
//
// Source: libp5glove (ezrec/libp5glove); newly written from its behaviour.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/frame/hand.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::p5 {

inline constexpr std::size_t kReportBytes = 24;
inline constexpr std::size_t kSpots = 4;
inline constexpr std::size_t kLeds = 8;  // the LEDs that a report can name
inline constexpr int kMaxBend = 63;

inline constexpr std::uint8_t kHeadsReport = 6;
inline constexpr std::size_t kHeadsBytes = 6;
inline constexpr std::uint8_t kFirmwareReport = 9;
inline constexpr std::size_t kFirmwareBytes = 3;
inline constexpr std::uint8_t kLedsReport = 12;
inline constexpr std::size_t kLedsBytes = 62;

// One LED as seen by the heads. A count is 1/512 of the distance in front of the head.
struct LedObservation {
  std::uint8_t led = 8;  // 8: no LED was seen
  std::int16_t v2 = 0, v1 = 0, h = 0;
};

struct Report {
  std::array<std::uint8_t, kFingers> bend{};  // thumb to little
  std::uint8_t buttons = 0;
  std::array<LedObservation, kSpots> spot{};
};

// kOk fills `report`; kForeign for another report number.
RT_SAFE [[nodiscard]] Outcome decode_report(std::span<const std::byte> bytes,
                                            Report& report) noexcept;
[[nodiscard]] std::array<std::byte, kReportBytes> encode_report(const Report& report) noexcept;

// Unwraps a 10-bit value, given the value `before` it (already unwrapped).
RT_SAFE [[nodiscard]] std::int16_t unwrapped(std::int16_t value, std::int16_t before) noexcept;

}  // namespace posed::drivers::p5
