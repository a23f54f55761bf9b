// WireReader: the fields of a protobuf message, one after the other, from untrusted bytes and
// without allocation and without exceptions: protobuf's own parser allocates, and protozero's
// throws at what is no message, which hot code may not. protobuf.dev, "Encoding".
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace posed::message {

enum class WireType : std::uint8_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };

struct WireField {
  std::uint32_t number = 0;
  WireType type = WireType::kVarint;
  std::uint64_t value = 0;             // of all types but kBytes
  std::span<const std::byte> bytes{};  // of kBytes

  [[nodiscard]] float as_float() const noexcept {
    return std::bit_cast<float>(static_cast<std::uint32_t>(value));
  }
  [[nodiscard]] std::string_view text() const noexcept {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
};

// A message's fields; the bytes must outlive it. RT-safe.
class WireReader {
 public:
  explicit WireReader(std::span<const std::byte> message) noexcept : left_(message) {}

  // Returns false at the end, and where the bytes are no field (then ok() is false).
  [[nodiscard]] bool next(WireField& field) noexcept {
    if (left_.empty()) return false;
    const std::uint64_t key = varint();
    if (!ok_ || key >> 3 == 0 || key >> 32 != 0) return stop();
    field.number = static_cast<std::uint32_t>(key >> 3);
    switch (key & 7) {
      case 0:
        field.type = WireType::kVarint;
        field.value = varint();
        return ok_;
      case 1:
        field.type = WireType::kFixed64;
        return fixed(8, field.value);
      case 2:
        field.type = WireType::kBytes;
        return accept(varint(), field.bytes);
      case 5:
        field.type = WireType::kFixed32;
        return fixed(4, field.value);
      default:
        return stop();
    }
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }

 private:
  static constexpr int kVarintBytes = 10;  // at most

  bool stop() noexcept {
    ok_ = false;
    left_ = {};
    return false;
  }
  std::uint64_t varint() noexcept {
    std::uint64_t value = 0;
    for (int i = 0; i < kVarintBytes && !left_.empty(); ++i) {
      const auto byte = std::to_integer<std::uint64_t>(left_.front());
      left_ = left_.subspan(1);
      value |= (byte & 0x7F) << (7 * i);
      if (byte < 0x80) return value;
    }
    stop();
    return 0;
  }
  bool accept(std::uint64_t count, std::span<const std::byte>& bytes) noexcept {
    if (!ok_ || count > left_.size()) return stop();
    bytes = left_.first(count);
    left_ = left_.subspan(count);
    return true;
  }
  // Little-endian, as the machines that posed runs on.
  bool fixed(std::size_t count, std::uint64_t& value) noexcept {
    static_assert(std::endian::native == std::endian::little);
    std::span<const std::byte> bytes;
    value = 0;
    if (!accept(count, bytes)) return false;
    std::memcpy(&value, bytes.data(), count);
    return true;
  }

  std::span<const std::byte> left_;
  bool ok_ = true;
};

}  // namespace posed::message
