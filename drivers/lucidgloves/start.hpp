// Starts a LucidGlove before it is read: waits for its stream and checks it.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/lucidgloves/decoder.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::lucidgloves {

// CP210x and CH340, the serial chips of the boards for which the firmware is made (vendor_id << 16
// | product_id).
inline constexpr std::array<std::uint32_t, 2> kUsbIds{0x10C4EA60, 0x1A867523};

// Waits a few seconds at most for a valid line, because a board that restarts when its port opens
// sends other text first. An error states what came instead, or that the glove is of the other
// hand. If possible, the link is left at the end of a line. Cold.
[[nodiscard]] Result<> start(Connection& link, Side side, const Settings& settings);

}  // namespace posed::drivers::lucidgloves
