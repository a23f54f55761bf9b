// BenchGlove: a glove that is not there, as a source of packets for the decoder beside it.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::cli {

struct BenchGlove {
  std::string name;                             // "described vmg30"
  std::unique_ptr<drivers::Emulator> emulator;  // streams
  std::unique_ptr<drivers::Decoder> decoder;
};

// One of every driver that can be emulated, and of every described device. A glove that streams
// only when it is told to has been told so by its driver, over a pseudo-terminal.
[[nodiscard]] Result<std::vector<BenchGlove>> bench_gloves();

// Adds the glove's next record to `out`, of a hand that closes and opens every 64 of them.
void next_record(BenchGlove& glove, std::size_t index, std::vector<std::byte>& out);

}  // namespace posed::cli
