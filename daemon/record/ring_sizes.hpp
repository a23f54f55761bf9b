// How much of the recorder's rings each source and each slot for a stream may use: what five
// seconds bring, and at least 8 MB over all sources. Slots of streams to come have a quarter of the
// decisions, and frames of at most 128 MiB together. Cold.
#pragma once

#include <cstddef>
#include <vector>

#include "daemon/record/recorded_stream.hpp"

namespace posed::record {

struct SlotSizes {
  std::size_t frame_bytes = 0;  // 0: published frames are not recorded
  std::size_t decisions = 0;
};

struct RingSizes {
  std::vector<std::size_t> chunk_bytes{};  // by source
  std::vector<SlotSizes> slots{};
};

// For a setup at its nominal rates; `frames`: the published frames are recorded, too.
[[nodiscard]] RingSizes ring_sizes(const RecordedSetup& setup, bool frames);

// Whether streams come while the daemon runs.
[[nodiscard]] bool bodies_come(const RecordedSetup& setup);

// The memory that rings of these sizes need.
[[nodiscard]] std::size_t total_bytes(const RingSizes& sizes);

}  // namespace posed::record
