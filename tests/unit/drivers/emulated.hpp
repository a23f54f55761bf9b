// The output of the emulators, as a device to open and as a log.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "proto/frame/hand.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"

namespace posed::test {

// The bodies that the emulator describes.
[[nodiscard]] std::unique_ptr<const drivers::SourceLayout> emulated_layout(
    const DeviceFixture& fixture);

// Pose `index` of a hand that closes and opens finger by finger, with a period of `count` poses.
[[nodiscard]] HandAngles closing_hand(std::size_t index, std::size_t count);

// The chunks that the fixture's emulator sends in `rounds` rounds of loop_chunks poses, each with
// its due time.
[[nodiscard]] std::vector<std::pair<std::int64_t, Bytes>> emulated_chunks(
    const DeviceFixture& fixture, std::size_t rounds);

// The fixture's device, which plays enough rounds for every test.
[[nodiscard]] drivers::Device open_emulated(const DeviceFixture& fixture);

// A recorded log's text (recorded_log.hpp) of one round, with damage, marked as emulated.
[[nodiscard]] std::string emulated_log(const DeviceFixture& fixture);

}  // namespace posed::test
