// The bytes of CyberGlove I, II and III. No I/O here; the drawings below are the whole format.
// Sources: the maker's library as found in VR Juggler (vt_glove.cpp), appendix C of the CyberGlove
// III manual, and the drivers of FreeVR, Vista, puppet, Shadow and asr.
//
// 8-bit form (I, II, and III in its compatible mode):
//      0        1 .. N       [5 bytes]       [1]      [pairs]      last
//   +--------+-----------+----------------+---------+------------+------+
//   | S G Y  | sensors   |   time stamp   | status  | e s, e g   |  00  |
//   +--------+-----------+----------------+---------+------------+------+
//    lead     S streamed, G polled, Y by external sync
//    sensors  N bytes of 1 to 255, those of the mask in ascending order
//    stamp    flags, then u32 LE [1/115200 s]; a counter byte of 0 is sent as 1 with its flag set
//    status   bit 0 glove plugged in, 1 switch, 2 light, 7 always set
//    pairs    e s: sampled too fast; e g: glove unplugged
//
// 16-bit form (III): 61 bytes
//      0 .. 12           13    14 .. 57          58 .. 60
//   +------------------+-----+-----------------+----------+
//   | HH:MM:SS:ff:n    |  S  | 22 x u16 BE     | 0D 0A 00 |
//   +------------------+-----+-----------------+----------+
//    ff  frame of 30 per second, n sub-frame; values of 12 bits, 1 to 4094
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "proto/frame/rt_safe.hpp"

namespace posed::drivers::cyberglove {

// Sensors by their bit in a mask: group * 4 + joint (CyberGlove Reference Manual, page 20).
inline constexpr std::size_t kSensors = 23;
enum SensorIndex : std::size_t {
  kThumbRoll,
  kThumbMcp,
  kThumbIp,
  kThumbAbd,
  kIndexMcp,
  kIndexPip,
  kIndexDip,
  kIndexAbd,  // has no sensor; its angle is computed from the other sensors
  kMiddleMcp,
  kMiddlePip,
  kMiddleDip,
  kMiddleAbd,  // between index and middle
  kRingMcp,
  kRingPip,
  kRingDip,
  kRingAbd,  // between middle and ring
  kLittleMcp,
  kLittlePip,
  kLittleDip,
  kLittleAbd,  // between ring and little
  kPalmArch,
  kWristPitch,
  kWristYaw,
};
inline constexpr std::uint32_t kMask18 = 0x7BBB3F;
inline constexpr std::uint32_t kMask22 = 0x7FFF7F;
inline constexpr std::uint32_t kAllSensors = (1U << kSensors) - 1;

enum class Form : std::uint8_t { k8Bit, k16Bit };
enum class Mode : std::uint8_t { kStream, kPoll, kSync };

// The format of a stream, agreed with the glove at the start.
struct Layout {
  Form form = Form::k8Bit;
  Mode mode = Mode::kStream;
  std::uint32_t mask = kMask22;  // the sensors in each sample
  bool time = true;
  bool status = true;
  int multiplier = 3;  // 16-bit form: sub-frames per frame
};

[[nodiscard]] constexpr std::byte lead(Mode mode) noexcept {
  constexpr std::array kLeads{std::byte{'S'}, std::byte{'G'}, std::byte{'Y'}};
  return kLeads[static_cast<std::size_t>(mode)];
}

// Rate of the time stamp and unit of the sample period.
inline constexpr double kTicks_hz = 115200.0;
inline constexpr std::size_t kStampBytes = 5;
inline constexpr std::size_t kMaxPairs = 2;
// Lead, sensors, stamp, status, pairs, end.
inline constexpr std::size_t kMaxSample = 1 + kSensors + kStampBytes + 1 + 2 * kMaxPairs + 1;

inline constexpr std::byte kPluggedIn{0x01};
inline constexpr std::byte kSwitch{0x02};
inline constexpr std::byte kLight{0x04};
inline constexpr std::byte kStatusMark{0x80};

// CyberTouch: 'A', n, then n times (motor, strength 0 to 255); motors 0 to 4 are thumb to little
// finger, 5 is the palm. The answer is 'A' 00, between two samples.
inline constexpr std::byte kTouch{'A'};

// Number of bytes before the pairs and the end: lead, sensors, stamp, status.
RT_SAFE [[nodiscard]] std::size_t sample_bytes(const Layout& layout) noexcept;

// False when a flag does not fit its byte.
RT_SAFE [[nodiscard]] bool decode_stamp(std::span<const std::byte, kStampBytes> bytes,
                                        std::uint32_t& count) noexcept;
[[nodiscard]] std::array<std::byte, kStampBytes> encode_stamp(std::uint32_t count) noexcept;

inline constexpr std::size_t kRecordBytes = 61;
inline constexpr std::size_t kRecordHead = 14;  // "HH:MM:SS:ff:n" and 'S'
inline constexpr int kFrames_hz = 30;
inline constexpr int kMaxMultiplier = 4;
inline constexpr std::array<std::byte, 3> kRecordEnd{std::byte{0x0D}, std::byte{0x0A},
                                                     std::byte{0x00}};
// The shape of "dd:dd:dd:dd:dS", where d is any digit.
inline constexpr std::string_view kRecordPattern = "dd:dd:dd:dd:dS";

[[nodiscard]] constexpr bool fits_pattern(std::size_t place, std::byte byte) noexcept {
  const char want = kRecordPattern[place];
  const char got = static_cast<char>(byte);
  return want == 'd' ? got >= '0' && got <= '9' : got == want;
}

// Sub-frames since midnight from a head that fits the pattern; negative when it is not a valid time
// of day.
RT_SAFE [[nodiscard]] std::int64_t decode_time_of_day(std::span<const std::byte, kRecordHead> head,
                                                      int multiplier) noexcept;
[[nodiscard]] std::array<std::byte, kRecordHead> encode_time_of_day(std::int64_t sub_frames,
                                                                    int multiplier) noexcept;
[[nodiscard]] constexpr std::int64_t sub_frames_a_day(int multiplier) noexcept {
  return std::int64_t{24} * 3600 * kFrames_hz * multiplier;
}

// The sample period in the form that `T` takes, w1 * w2 ticks: as close to `rate_hz` as possible;
// 0, 0 (as fast as possible) for 0.
struct Period {
  std::uint16_t w1 = 0, w2 = 0;
  [[nodiscard]] std::int64_t ticks() const noexcept { return std::int64_t{w1} * w2; }
};
[[nodiscard]] Period period_of(double rate_hz) noexcept;

}  // namespace posed::drivers::cyberglove
