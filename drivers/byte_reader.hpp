// ByteReader: reads little-endian values from untrusted bytes. A read beyond the end gives zero and
// clears ok(), so that a parser checks once instead of at every value.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace posed::drivers {

// RT-safe.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) noexcept : left_(bytes) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t left() const noexcept { return left_.size(); }

  [[nodiscard]] std::uint8_t u8() noexcept { return static_cast<std::uint8_t>(number(1)); }
  [[nodiscard]] std::uint16_t u16() noexcept { return static_cast<std::uint16_t>(number(2)); }
  [[nodiscard]] std::uint32_t u32() noexcept { return number(4); }
  [[nodiscard]] float f32() noexcept { return std::bit_cast<float>(number(4)); }

  // Empty when so many are not left.
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t count) noexcept {
    if (count > left_.size()) {
      ok_ = false;
      left_ = {};
      return {};
    }
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }
  [[nodiscard]] std::string_view text(std::size_t count) noexcept {
    const auto taken = bytes(count);
    return {reinterpret_cast<const char*>(taken.data()), taken.size()};
  }

 private:
  std::uint32_t number(std::size_t count) noexcept {
    std::uint32_t value = 0;
    int shift = 0;
    for (const std::byte byte : bytes(count)) {
      value |= std::to_integer<std::uint32_t>(byte) << shift;
      shift += 8;
    }
    return value;
  }

  std::span<const std::byte> left_;
  bool ok_ = true;
};

}  // namespace posed::drivers
