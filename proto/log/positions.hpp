// The column `sequences` of a chunk: for each stream of its source {u32 stream id, u64 number of
// its next frame, u64 number of its next sample}, little-endian, one after the other.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "proto/log/rows.hpp"

namespace posed::log {

// Both replace the content of `out`; the caller passes it in so that its memory is reused.
void pack_positions(std::span<const StreamPosition> places, std::vector<std::byte>& out);
// Returns false when the bytes are not a whole number of entries.
[[nodiscard]] bool unpack_positions(std::span<const std::byte> bytes,
                                    std::vector<StreamPosition>& out);

}  // namespace posed::log
