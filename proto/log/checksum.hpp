// Checksum of a row in a log: zlib's CRC-32 over its columns in order, without the crc column
// itself. An integer counts as 8 little-endian bytes; a text or blob as its length, in 8
// little-endian bytes, followed by its bytes. Any tool can therefore compute it from what SQLite
// shows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <zlib.h>

namespace posed::log {

class Checksum {
 public:
  void add(std::int64_t value) {
    std::array<Bytef, 8> bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<Bytef>(static_cast<std::uint64_t>(value) >> (8 * i));
    }
    crc_ = crc32_z(crc_, bytes.data(), bytes.size());
  }

  void add(std::span<const std::byte> bytes) {
    add(static_cast<std::int64_t>(bytes.size()));
    // zlib treats a null pointer as a request to start anew.
    if (!bytes.empty()) {
      crc_ = crc32_z(crc_, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
    }
  }

  // 0 to 2^32 - 1, as stored in the column `crc`.
  [[nodiscard]] std::int64_t value() const { return static_cast<std::int64_t>(crc_); }

 private:
  uLong crc_ = crc32_z(0, nullptr, 0);
};

}  // namespace posed::log
