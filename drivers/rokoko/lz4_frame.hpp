// An LZ4 frame (lz4's doc/lz4_Frame_format.md) into a buffer of fixed size. LZ4F_decompress
// allocates when it sees a frame's head, so the head and the blocks are read here, and liblz4
// decompresses each block.
#pragma once

#include <cstddef>
#include <span>

#include "proto/frame/sink.hpp"

namespace posed::drivers::rokoko {

// True for bytes that begin with the frame's magic number 04 22 4D 18.
RT_SAFE [[nodiscard]] bool is_lz4_frame(std::span<const std::byte> bytes) noexcept;

// kOk: `content` is the part of `room` that holds the content. kOutOfRange: it does not fit.
// kBadChecksum: of the head, a block or the content. kShort: cut, damaged, or goes on after its
// end. kForeign: another version of the format, or one that needs a dictionary.
RT_SAFE [[nodiscard]] Outcome decode_lz4_frame(std::span<const std::byte> bytes,
                                               std::span<std::byte> room,
                                               std::span<const std::byte>& content) noexcept;

}  // namespace posed::drivers::rokoko
