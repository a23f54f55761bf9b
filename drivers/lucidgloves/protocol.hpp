// The lines of a LucidGlove and of other gloves that speak OpenGloves. No I/O here.
//
// Glove to host, one line per measurement, ended by LF or CR LF; empty lines are ignored. Values
// are decimal, 0 to max: 4095 on an ESP32, 1023 on an AVR board.
//
//   alpha    A1662B3329C1229D4095E4095F384G0P512(AAB)1500(BB)2048ILM      keys in any order
//     A B C D E   curl of thumb, index, middle, ring, pinky: 0 open, max closed
//     (AAB)       one joint of finger A: AAA is its joint 0, AAD its joint 3; a missing joint
//                 takes its finger's curl
//     (AB)        splay of finger A: 0, max/2 in the middle, max
//     F G P       joystick X and Y, analog trigger (a closed finger sends max + 1)
//     H I J K L M N O   pressed: joystick, trigger, A, B, grab, pinch, menu, calibrate
//     Z(ZV)5(ZG)0(ZH)1  device info: firmware, kind of device, hand (0 left, 1 right)
//   legacy   thumb&index&middle&ring&pinky&joyX&joyY&joyClick&trigger&A&B&grab&pinch
//
// Host to glove: force feedback A0B500C1000D0E0 (0 free, most blocked, below 0 unchanged) or
// 0&500&1000&0&0; vibration F80.00G0.10H0.50 (Hz, seconds, strength); (ZA) starts the stream, (ZZ)
// stops it, Z asks for the device info.
//
// Sources: LucidVR/lucidgloves firmware, LucidVR/opengloves-driver, senseshift/opengloves-lib.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto/frame/hand.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::lucidgloves {

inline constexpr std::size_t kMaxLine = 256;  // bytes; a longer line is not from a glove
inline constexpr int kMaxAnalog = 65535;  // largest allowed value of the option max_analog_value
inline constexpr int kJoints = 4;         // per finger; joint 0 is in the palm

// Indices of the values of a line.
inline constexpr std::size_t kCurl = 0;
inline constexpr std::size_t kJoint = kCurl + kFingers;             // finger by finger
inline constexpr std::size_t kSplay = kJoint + kFingers * kJoints;  // finger by finger
inline constexpr std::size_t kJoyX = kSplay + kFingers;
inline constexpr std::size_t kJoyY = kJoyX + 1;
inline constexpr std::size_t kTrigger = kJoyX + 2;
inline constexpr std::size_t kValues = kJoyX + 3;

inline constexpr std::size_t kButtons = 8;  // in the order of the keys H to O
inline constexpr std::array<std::string_view, kButtons> kButtonNames{
    "joystick_button", "trigger_button", "button_a", "button_b", "grab",
    "pinch",           "menu",           "calibrate"};

enum class Encoding : std::uint8_t { kAuto, kAlpha, kLegacy };
inline constexpr std::array<std::string_view, 3> kEncodingNames{"auto", "alpha", "legacy"};

struct Line {
  std::array<int, kValues> value{};
  std::bitset<kValues> has;
  std::bitset<kButtons> pressed;
  std::array<int, 3> info{};  // firmware, kind of device, hand
  std::bitset<3> has_info;

  // True when the line contains a measurement of a finger.
  RT_SAFE [[nodiscard]] bool has_hand() const noexcept;
};

// Parses `text`, without its LF. kOk fills `line`; kOutOfRange for a value above `max`; kShort for
// a legacy line with fewer than thirteen values, or an alpha line with neither a finger nor an
// info; kForeign for input that no glove sends: an unknown character, a value without a key, a
// repeated key.
RT_SAFE [[nodiscard]] Outcome parse_line(std::string_view text, Encoding encoding, int max,
                                         Line& line) noexcept;

// The line that the glove would send, including LF.
[[nodiscard]] std::string alpha_line(const Line& line);
[[nodiscard]] std::string legacy_line(const Line& line);

// The lines that the host sends, including LF. A force below 0 leaves that finger's motor
// unchanged.
using Forces = std::array<int, kFingers>;
[[nodiscard]] std::string force_line(const Forces& forces, Encoding encoding);
[[nodiscard]] std::string vibration_line(double frequency_hz, double duration_s, double strength);

// Applies a host's line as the glove does: forces that it does not name, and negative ones, are
// unchanged.
void apply_force_line(std::string_view text, Forces& forces);

}  // namespace posed::drivers::lucidgloves
