// BenchGlove: an emulated glove as a source of packets, with its decoder.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct BenchGlove {
  std::string name;                             // "described vmg30"
  std::unique_ptr<drivers::Emulator> emulator;  // already streaming
  std::unique_ptr<drivers::Decoder> decoder;
};

// One of every driver that can be emulated, and one of every table-driven device. If a glove
// streams only on command, its driver has sent that command through a pseudo-terminal.
[[nodiscard]] Result<std::vector<BenchGlove>> bench_gloves();

// Adds the glove's next record to `out`, for a hand that closes and opens every 64 records.
void next_record(BenchGlove& glove, std::size_t index, std::vector<std::byte>& out);

}  // namespace posed::tools
