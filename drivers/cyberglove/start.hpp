// The session with a CyberGlove before it streams: who it is, what it wears, how it shall send.
#pragma once

#include "drivers/cyberglove/protocol.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::cyberglove {

// What the options ask for.
struct RequestedConfig {
  Side hand = Side::kRight;
  int sensors = 0;  // 0: as many as there are
  Layout layout;    // without the mask
  bool filter = true;
  Period period;          // of the 8-bit form
  int divider = 1;        // of the 16-bit form
  bool over_tcp = false;  // a III's Wi-Fi
  std::int64_t baud = 0;  // for the sentence about a wrong one
};

// Stops what runs, asks, sets and starts; gives the layout with the glove's own mask. Errors are
// one sentence: nothing answers, another device, glove not in its box, other hand, other sensors.
// Cold: a second or two.
[[nodiscard]] Result<Layout> start(Connection& link, const RequestedConfig& requested);

}  // namespace posed::drivers::cyberglove
