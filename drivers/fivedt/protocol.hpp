// The packets of 5DT data gloves. No I/O here.
//
//   Data Glove 5, serial, 19200 8N1. The host sends one letter: A resets it, answered by 55; G asks
//   for its info, answered by 32 bytes ("BR", major, minor, bit 0: right, bit 4: pitch and roll
//   fitted, .. name from byte 16); C asks for one packet; D starts continuous packets.
//      0      1       2       3       4       5        6       7       8
//   +------+-------+-------+-------+------+--------+-------+------+----------+
//   |  80  | thumb | index | middle| ring | little | pitch | roll | checksum |  then sometimes 55
//   +------+-------+-------+-------+------+--------+-------+------+----------+
//     bends 0 (straight) to 255; pitch and roll 0 to 255 for 0 to 180 degrees; checksum: XOR of
//     bytes 1 to 7. 80 may also be data.
//   Data Glove 5 of the wireless type, 9600 8N1: the same without a request, with a tenth byte
//     for the hand (01 or 00 right, 40 or 06 left: sources differ).
//   Data Glove 16, serial, 19200 8N1, without a request:
//     '<' 'I' hw-major hw-minor flags(bit 0: right) flags(bit 0: wired) ?             7 bytes
//     '<' 'D' 16 values of 12 bits as u16 BE, 2 bytes of unknown meaning             36 bytes
//   Ultra Wireless kit, serial: 29 bytes
//     3C, port (low nibble 2 or 3: A, else B), ?, 14 values of 12 bits packed most significant bit
//     first (21 bytes), 5 bytes of unknown meaning. 3C may also be data.
//   Ultra USB, HID: reports of 64 bytes without a report number; 16 values of 12 bits as i16 BE,
//   then 32
//     bytes of unknown meaning. Five sensors are values 0, 3, 6, 9 and 12.
//
// Order of the wide gloves' values: thumb near, thumb far, thumb/index, index near, index far,
// index/middle, middle near, far, middle/ring, ring near, far, ring/little, little near, far, and
// of sixteen thumb/palm and wrist.
//
// Sources: VRPN (vrpn_Analog_5dt.C, vrpn_5DT16.C, vrpn_Analog_5dtUSB.C), VR Juggler's 5DT driver.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "proto/frame/hand.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::fivedt {

enum class Form : std::uint8_t {
  kFive,
  kFiveWireless,
  kSixteen,
  kUltraWireless,
  kUltraUsb5,
  kUltraUsb14
};
inline constexpr std::array<std::string_view, 6> kFormNames{
    "5", "5-wireless", "16", "ultra-wireless", "ultra-usb-5", "ultra-usb-14"};

inline constexpr std::size_t kMaxPacket = 64;
inline constexpr std::size_t kMaxValues = 16;
inline constexpr std::byte kReady{0x55};  // the answer to A; may also follow a packet

RT_SAFE [[nodiscard]] bool is_usb(Form form) noexcept;  // sends reports, not a byte stream
RT_SAFE [[nodiscard]] std::size_t sensors_of(Form form) noexcept;
RT_SAFE [[nodiscard]] std::size_t packet_bytes(Form form) noexcept;  // of a measurement packet
// Index of sensor `index` among the values of a packet.
RT_SAFE [[nodiscard]] std::size_t value_of_sensor(Form form, std::size_t index) noexcept;

// The content of one packet.
struct Reading {
  enum class Kind : std::uint8_t { kData, kInfo };
  Kind kind = Kind::kData;
  std::array<std::uint16_t, kMaxValues> value{};
  std::uint8_t pitch = 0, roll = 0;  // of a Data Glove 5
  bool port_b = false;               // of an Ultra Wireless kit
  bool right = true;                 // of an info packet
};

// Length of the packet that begins with these bytes; 0 when no packet begins like this. One byte is
// enough to tell whether it is 0; until the length is certain, it is a lower bound greater than
// bytes.size().
RT_SAFE [[nodiscard]] std::size_t packet_length(Form form,
                                                std::span<const std::byte> bytes) noexcept;

// `bytes` is one packet. Fills `reading` and returns kOk; otherwise kBadChecksum, kOutOfRange (more
// than 12 bits) or kForeign.
RT_SAFE [[nodiscard]] Outcome decode_packet(Form form, std::span<const std::byte> bytes,
                                            Reading& reading) noexcept;

// The bytes that the glove would send; `side` goes into the tenth byte of a wireless type.
[[nodiscard]] std::vector<std::byte> encode_packet(Form form, const Reading& reading, Side side);
// Length of a Data Glove 5's answer to G; only its hand is used.
inline constexpr std::size_t kInfoBytes = 32;
[[nodiscard]] std::vector<std::byte> encode_info(Side side);

// True when the byte is a valid tenth byte of a wireless type; and when it means a left hand.
RT_SAFE [[nodiscard]] bool is_capability(std::byte byte) noexcept;
[[nodiscard]] bool says_left(std::byte capability) noexcept;

}  // namespace posed::drivers::fivedt
