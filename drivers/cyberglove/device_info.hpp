// The device info of a CyberGlove, kept in Description::text:
//   cyberglove hand=right sensors=22 mask=8388479 form=8bit mode=stream time=1 status=1 ticks=1152
//   multiplier=1                      (one line; ticks of 1/115200 s between samples, 0 unknown)
#pragma once

#include <array>
#include <string>

#include "drivers/cyberglove/protocol.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::cyberglove {

inline constexpr std::array<std::string_view, 2> kForms{"8bit", "16bit"};           // as Form
inline constexpr std::array<std::string_view, 3> kModes{"stream", "poll", "sync"};  // as Mode

struct GloveSettings {
  Side hand = Side::kRight;
  Layout layout;
  std::int64_t ticks = 0;
};

[[nodiscard]] std::string device_info_of(const GloveSettings& glove);
[[nodiscard]] Result<GloveSettings> read_device_info(const std::string& text,
                                                     const std::string& identity);

}  // namespace posed::drivers::cyberglove
