// ByteWriter builds packets of little-endian values, BigEndianWriter of big-endian ones: for
// emulators, outputs and requests. Cold: allocates.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace posed::drivers {

template <std::endian order>
class BasicByteWriter {
 public:
  void u8(std::uint8_t value) { number(value, 1); }
  void u16(std::uint16_t value) { number(value, 2); }
  void u32(std::uint32_t value) { number(value, 4); }
  void u64(std::uint64_t value) { number(value, 8); }
  void i16(std::int16_t value) { u16(static_cast<std::uint16_t>(value)); }
  void i32(std::int32_t value) { u32(static_cast<std::uint32_t>(value)); }
  void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
  void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }
  void bytes(std::span<const std::byte> values) {
    bytes_.insert(bytes_.end(), values.begin(), values.end());
  }
  void text(std::string_view value) { bytes(std::as_bytes(std::span(value))); }

  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }
  // For lengths and checksums that are known only at the end.
  [[nodiscard]] std::vector<std::byte>& written() noexcept { return bytes_; }
  [[nodiscard]] std::vector<std::byte> finish() { return std::move(bytes_); }

 private:
  void number(std::uint64_t value, std::size_t count) {
    std::array<std::byte, sizeof value> bytes{};
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t place = order == std::endian::little ? i : count - 1 - i;
      bytes[i] = static_cast<std::byte>(value >> 8 * place & 0xFF);
    }
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
  }

  std::vector<std::byte> bytes_;
};

using ByteWriter = BasicByteWriter<std::endian::little>;
using BigEndianWriter = BasicByteWriter<std::endian::big>;

}  // namespace posed::drivers
