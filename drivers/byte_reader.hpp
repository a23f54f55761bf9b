// ByteReader reads little-endian values from untrusted bytes, BigEndianReader big-endian ones. A
// read beyond the end gives zero and clears ok(), so that a parser checks once instead of at every
// value.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace posed::drivers {

// RT-safe.
template <std::endian order>
class BasicByteReader {
 public:
  explicit BasicByteReader(std::span<const std::byte> bytes) noexcept : left_(bytes) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t left() const noexcept { return left_.size(); }

  [[nodiscard]] std::uint8_t u8() noexcept { return static_cast<std::uint8_t>(number(1)); }
  [[nodiscard]] std::uint16_t u16() noexcept { return static_cast<std::uint16_t>(number(2)); }
  [[nodiscard]] std::uint32_t u32() noexcept { return static_cast<std::uint32_t>(number(4)); }
  [[nodiscard]] std::uint64_t u64() noexcept { return number(8); }
  [[nodiscard]] std::int16_t i16() noexcept { return static_cast<std::int16_t>(u16()); }
  [[nodiscard]] std::int32_t i32() noexcept { return static_cast<std::int32_t>(u32()); }
  [[nodiscard]] float f32() noexcept { return std::bit_cast<float>(u32()); }
  [[nodiscard]] double f64() noexcept { return std::bit_cast<double>(u64()); }

  // Empty when so many are not left.
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t count) noexcept {
    if (count > left_.size()) {
      ok_ = false;
      left_ = {};
      return {};
    }
    const auto read = left_.first(count);
    left_ = left_.subspan(count);
    return read;
  }
  [[nodiscard]] std::string_view text(std::size_t count) noexcept {
    const auto read = bytes(count);
    return {reinterpret_cast<const char*>(read.data()), read.size()};
  }

 private:
  std::uint64_t number(std::size_t count) noexcept {
    std::uint64_t value = 0;
    int shift = 0;
    for (const std::byte byte : bytes(count)) {
      if constexpr (order == std::endian::little) {
        value |= std::to_integer<std::uint64_t>(byte) << shift;
        shift += 8;
      } else {
        value = value << 8 | std::to_integer<std::uint64_t>(byte);
      }
    }
    return value;
  }

  std::span<const std::byte> left_;
  bool ok_ = true;
};

using ByteReader = BasicByteReader<std::endian::little>;
using BigEndianReader = BasicByteReader<std::endian::big>;

}  // namespace posed::drivers
