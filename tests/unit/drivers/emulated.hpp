// Gloves that nobody has plugged in: what their emulators send, as a device to open and as a log.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "proto/frame/hand.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"

namespace posed::test {

// A hand that closes and opens, each finger in its turn; equal after `count` poses.
[[nodiscard]] HandAngles closing_hand(std::size_t index, std::size_t count);

// What the fixture's emulator sends in `rounds` rounds of loop_chunks poses, and when it was due.
[[nodiscard]] std::vector<std::pair<std::int64_t, Bytes>> emulated_chunks(
    const DeviceFixture& fixture, std::size_t rounds);

// The fixture as its options promise it, playing rounds enough for every test.
[[nodiscard]] drivers::Device open_emulated(const DeviceFixture& fixture);

// A recorded log's text (recorded_log.hpp) of one round, with damage, marked as emulated.
[[nodiscard]] std::string emulated_log(const DeviceFixture& fixture);

}  // namespace posed::test
