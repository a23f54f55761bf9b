// The column `sequences` of a chunk: of each stream of its source {u32 stream id, u64 number of its
// next frame, u64 number of its next sample}, little-endian, one after the other.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "proto/log/rows.hpp"

namespace posed::log {

// Both replace what `out` held; it is handed in so that its memory is used again.
void pack_places(std::span<const StreamPlace> places, std::vector<std::byte>& out);
// False: the bytes are no whole number of places.
[[nodiscard]] bool unpack_places(std::span<const std::byte> bytes, std::vector<StreamPlace>& out);

}  // namespace posed::log
