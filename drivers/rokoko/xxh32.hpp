// XXH32, the checksum of LZ4 frames (xxHash's specification, doc/xxhash_spec.md), with seed 0.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/byte_reader.hpp"

namespace posed::drivers::rokoko {

// RT-safe.
[[nodiscard]] inline std::uint32_t xxh32(std::span<const std::byte> bytes) noexcept {
  constexpr std::uint32_t kP1 = 2654435761U, kP2 = 2246822519U, kP3 = 3266489917U, kP4 = 668265263U,
                          kP5 = 374761393U;
  ByteReader reader(bytes);
  std::uint32_t sum = kP5;
  if (bytes.size() >= 16) {
    std::uint32_t lanes[]{kP1 + kP2, kP2, 0U, 0U - kP1};
    while (reader.left() >= 16) {
      for (std::uint32_t& lane : lanes) lane = std::rotl(lane + reader.u32() * kP2, 13) * kP1;
    }
    sum = std::rotl(lanes[0], 1) + std::rotl(lanes[1], 7) + std::rotl(lanes[2], 12) +
          std::rotl(lanes[3], 18);
  }
  sum += static_cast<std::uint32_t>(bytes.size());
  while (reader.left() >= 4) sum = std::rotl(sum + reader.u32() * kP3, 17) * kP4;
  while (reader.left() > 0) sum = std::rotl(sum + reader.u8() * kP5, 11) * kP1;
  sum = (sum ^ sum >> 15U) * kP2;
  sum = (sum ^ sum >> 13U) * kP3;
  return sum ^ sum >> 16U;
}

}  // namespace posed::drivers::rokoko
