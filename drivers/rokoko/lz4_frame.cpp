#include "drivers/rokoko/lz4_frame.hpp"

#include <lz4.h>
#include <xxhash.h>

#include <algorithm>
#include <cstdint>

#include "drivers/byte_reader.hpp"

namespace posed::drivers::rokoko {
namespace {

// The checksum of LZ4 frames.
std::uint32_t xxh32_of(std::span<const std::byte> bytes) noexcept {
  return XXH32(bytes.data(), bytes.size(), 0);
}

constexpr std::uint32_t kMagicNumber = 0x184D2204;
constexpr std::size_t kMagicBytes = 4;
constexpr std::size_t kWindowBytes = 64 * 1024;  // how far back a block refers
constexpr std::uint32_t kStored = 0x80000000U;   // in a block's size: not compressed

// The bits of the head's first byte, and the largest size of a block by its second.
struct Lz4Head {
  bool linked = false, block_sums = false, content_sum = false, has_size = false;
  std::uint64_t size = 0;
  std::size_t block = 0;
};

RT_SAFE Outcome read_head(std::span<const std::byte> bytes, ByteReader& reader,
                          Lz4Head& head) noexcept {
  const unsigned flags = reader.u8();
  const unsigned sizes = reader.u8();
  head.linked = (flags & 0x20U) == 0;
  head.block_sums = (flags & 0x10U) != 0;
  head.has_size = (flags & 0x08U) != 0;
  head.content_sum = (flags & 0x04U) != 0;
  const unsigned step = sizes >> 4U & 7U;  // 4 to 7: 64 KB, 256 KB, 1 MB, 4 MB
  const bool known = flags >> 6U == 1 && (flags & 0x03U) == 0 && (sizes & 0x8FU) == 0 && step >= 4;
  if (reader.ok() && !known) return Outcome::kForeign;
  head.block = std::size_t{1} << (8U + 2U * step);
  if (head.has_size) head.size = reader.u64();
  const std::size_t covered = bytes.size() - kMagicBytes - reader.left();
  const std::uint8_t sum = reader.u8();
  if (!reader.ok()) return Outcome::kShort;
  const std::uint32_t expected = xxh32_of(bytes.subspan(kMagicBytes, covered));
  return sum == (expected >> 8U & 0xFFU) ? Outcome::kOk : Outcome::kBadChecksum;
}

// Puts one block behind the `used` bytes of the content.
RT_SAFE Outcome accept_block(const Lz4Head& head, std::span<const std::byte> block, bool stored,
                             std::span<std::byte> room, std::size_t& used) noexcept {
  const std::size_t most = std::min(head.block, room.size() - used);
  if (stored) {
    if (block.size() > head.block) return Outcome::kShort;
    if (block.size() > most) return Outcome::kOutOfRange;
    std::ranges::copy(block, room.begin() + static_cast<std::ptrdiff_t>(used));
    used += block.size();
    return Outcome::kOk;
  }
  const std::size_t before = head.linked ? std::min(used, kWindowBytes) : 0;
  char* const to = reinterpret_cast<char*>(room.data() + used);
  const int size = LZ4_decompress_safe_usingDict(
      reinterpret_cast<const char*>(block.data()), to, static_cast<int>(block.size()),
      static_cast<int>(most), to - before, static_cast<int>(before));
  // liblz4 does not say whether the block is damaged or too long.
  if (size < 0) return most < head.block ? Outcome::kOutOfRange : Outcome::kShort;
  used += static_cast<std::size_t>(size);
  return Outcome::kOk;
}

}  // namespace

RT_SAFE bool is_lz4_frame(std::span<const std::byte> bytes) noexcept {
  return ByteReader(bytes).u32() == kMagicNumber;
}

RT_SAFE Outcome decode_lz4_frame(std::span<const std::byte> bytes, std::span<std::byte> room,
                                 std::span<const std::byte>& content) noexcept {
  ByteReader reader(bytes);
  if (reader.u32() != kMagicNumber) return Outcome::kForeign;
  Lz4Head head;
  if (const Outcome outcome = read_head(bytes, reader, head); outcome != Outcome::kOk) {
    return outcome;
  }
  if (head.has_size && head.size > room.size()) return Outcome::kOutOfRange;
  std::size_t used = 0;
  for (;;) {
    const std::uint32_t word = reader.u32();
    if (!reader.ok()) return Outcome::kShort;
    if (word == 0) break;
    const auto block = reader.bytes(word & ~kStored);
    if (!reader.ok() || block.empty()) return Outcome::kShort;
    if (head.block_sums && reader.u32() != xxh32_of(block)) {
      return reader.ok() ? Outcome::kBadChecksum : Outcome::kShort;
    }
    const Outcome outcome = accept_block(head, block, (word & kStored) != 0, room, used);
    if (outcome != Outcome::kOk) return outcome;
  }
  content = room.first(used);
  if (head.content_sum && reader.u32() != xxh32_of(content)) {
    return reader.ok() ? Outcome::kBadChecksum : Outcome::kShort;
  }
  const bool whole = reader.ok() && reader.left() == 0;
  return whole && (!head.has_size || head.size == used) ? Outcome::kOk : Outcome::kShort;
}

}  // namespace posed::drivers::rokoko
