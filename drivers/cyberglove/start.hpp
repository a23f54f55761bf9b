// Starts a CyberGlove: checks the device, the hand and the sensors, and sets the stream's format.
#pragma once

#include <string>

#include "drivers/cyberglove/protocol.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::cyberglove {

// The settings that the options request. A device info keeps hand, layout and ticks of them.
struct RequestedConfig {
  Side hand = Side::kRight;
  int sensors = 0;  // 0: accept any number
  Layout layout{};  // as requested; its sensor mask is not used, the glove's own counts
  bool filter = true;
  // The rate: `period` in the 8-bit form, `divider` in the 16-bit form; `ticks` says what it gives.
  Period period{};
  int divider = 1;
  bool over_tcp = false;   // Wi-Fi of a III
  std::int64_t baud = 0;   // for the error message about a wrong one
  std::int64_t ticks = 0;  // of 1/115200 s between samples; 0: unknown
};

// The device info is one line, for example
//   cyberglove hand=right sensors=22 mask=8388479 form=8bit mode=stream time=1 status=1 ticks=1152
//   multiplier=1                             (ticks of 1/115200 s between samples, 0: unknown)
[[nodiscard]] std::string device_info_of(const RequestedConfig& settings);

// Stops a running stream, queries and sets the box, and starts it. Returns the layout with the
// glove's own mask. Errors: no answer, another device, glove not plugged into its box, wrong hand,
// wrong number of sensors. Cold: takes a second or two.
Result<Layout> start(Connection& link, const RequestedConfig& requested);

}  // namespace posed::drivers::cyberglove
