// What is said to a LucidGlove before it is read: its stream is awaited and checked.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/lucidgloves/decoder.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::lucidgloves {

// CP210x and CH340, the serial chips of the boards the firmware is made for (vendor << 16 |
// product).
inline constexpr std::array<std::uint32_t, 2> kUsbIds{0x10C4EA60, 0x1A867523};

// Waits for a good line, a few seconds at most: a board that starts when its port is opened talks
// of other things first. An error says what came instead, or that the glove is of the other hand.
// The link is left at the end of a line where possible. Cold.
[[nodiscard]] Result<> start(Connection& link, Side side, const Settings& settings);

}  // namespace posed::drivers::lucidgloves
