// The bytes of the template device, a bend sensor on one finger, invented for posed. No I/O here:
// the drawing below is the whole format, and tests build packets with the same functions.
//
// On connection it sends its device info, one line of text:  BEND1 rate=100
// Then it sends one packet of six bytes per period:
//
//      0        1        2   3        4         5
//   +--------+--------+--------+---------+----------+
//   |  0xA5  | count  |  bend  | battery | checksum |
//   +--------+--------+--------+---------+----------+
//    count     u8, one more each packet, wraps from 255 to 0
//    bend      i16 LE [0.01 degree], -2000 (stretched back) to 12000 (fist)
//    battery   u8 [percent], 0 to 100
//    checksum  u8, sum of bytes 0 to 4 modulo 256
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "proto/frame/result.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::bend {

inline constexpr std::size_t kPacketBytes = 6;
inline constexpr std::byte kStart{0xA5};

struct Packet {
  std::uint8_t count = 0;
  float bend_rad = 0.0F;
  float battery = 0.0F;  // 0 to 1
};

// kOk fills `packet`; kForeign when the first byte is not a start; kBadChecksum; kOutOfRange.
// RT-safe.
[[nodiscard]] Outcome decode_packet(std::span<const std::byte, kPacketBytes> bytes,
                                    Packet& packet) noexcept;

// The bytes that the device would send. Values outside the sensor's range can be encoded too, to
// imitate a faulty device.
[[nodiscard]] std::array<std::byte, kPacketBytes> encode_packet(const Packet& packet) noexcept;

// The device info, and the rate [Hz] in it.
[[nodiscard]] std::string device_info_text(double rate_hz);
[[nodiscard]] Result<double> parse_device_info(const std::string& text,
                                               const std::string& identity);

}  // namespace posed::drivers::bend
