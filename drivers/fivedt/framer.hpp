// Framer: splits the byte stream of a 5DT glove into packets. The start of a packet is found by its
// checksum (Data Glove 5), its shape (16, USB) or only its regular spacing (Ultra Wireless).
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <span>

#include "drivers/fivedt/protocol.hpp"

namespace posed::drivers::fivedt {

// Receives the packets that a Framer finds. RT-safe.
class Readings {
 public:
  Readings() = default;
  Readings(const Readings&) = delete;
  Readings& operator=(const Readings&) = delete;
  virtual ~Readings() = default;

  virtual void reading(const Reading& reading) noexcept = 0;  // called after its kOk
  virtual void outcome(Outcome outcome) noexcept = 0;
};

class Framer {
 public:
  explicit Framer(Form form) noexcept : form_(form) {}

  // Reads bytes cut at any position.
  RT_SAFE void feed(std::span<const std::byte> bytes, Readings& readings) noexcept;

  // The last byte that a wireless glove sent after a packet; -1: none yet.
  RT_SAFE [[nodiscard]] int capability() const noexcept { return capability_; }

 private:
  [[nodiscard]] bool advance(Readings& readings) noexcept;
  [[nodiscard]] bool advance_in_step(Readings& readings) noexcept;
  [[nodiscard]] bool advance_hunting() noexcept;
  [[nodiscard]] bool skip_damaged() noexcept;
  [[nodiscard]] bool is_packet(std::span<const std::byte> bytes) noexcept;
  [[nodiscard]] bool is_tail(std::byte byte) const noexcept;
  [[nodiscard]] bool consume_tail() noexcept;
  [[nodiscard]] bool is_half_used(std::span<const std::byte> report) noexcept;
  void drop(std::size_t count) noexcept;
  [[nodiscard]] std::span<const std::byte> pending() const noexcept {
    return std::span(pending_).first(pending_bytes_);
  }

  Form form_;
  std::array<std::byte, 2 * kMaxPacket + 1> pending_{};  // a packet, its tail and the next one
  std::size_t pending_bytes_ = 0;
  bool in_step_ = true;        // false while searching; one outcome per search, not per byte
  bool just_lost_ = false;     // the packet after the damaged one was not tried yet
  bool after_packet_ = false;  // a tail may follow
  int capability_ = -1;
  std::size_t hunted_ = 0;  // bytes discarded since the last packet
  std::bitset<256> ports_;  // second bytes of an Ultra Wireless kit's records so far
  enum class Tail : std::uint8_t { kUnknown, kZero, kUsed } usb_tail_ = Tail::kUnknown;
};

}  // namespace posed::drivers::fivedt
