// Packer writes little-endian values into a buffer of the caller, without allocating. (ByteWriter
// makes the same bytes in memory of its own.) All of it is RT-safe.
#pragma once

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

namespace posed::drivers {

class Packer {
 public:
  // `out` must have room for all that is written.
  explicit Packer(std::span<std::byte> out) noexcept : out_(out) {}

  void u8(std::size_t value) noexcept {
    assert(size_ < out_.size());
    out_[size_++] = static_cast<std::byte>(value);
  }
  void number(std::uint64_t value, std::size_t bytes) noexcept {
    for (std::size_t i = 0; i < bytes; ++i) u8(value >> 8 * i & 0xFF);
  }
  void f32(float value) noexcept { number(std::bit_cast<std::uint32_t>(value), 4); }
  void text(std::span<const char> value) noexcept {
    for (const char c : value) u8(static_cast<unsigned char>(c));
  }
  // A text behind its length in a byte.
  void counted(std::span<const char> value) noexcept {
    u8(value.size());
    text(value);
  }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::span<const std::byte> written() const noexcept { return out_.first(size_); }

 private:
  std::span<std::byte> out_;
  std::size_t size_ = 0;
};

}  // namespace posed::drivers
