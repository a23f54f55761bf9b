// FaultInjector: simulates faults between a glove and a host; it sits between an emulator and its
// link. Pure and repeatable: the same kind, rate, seed and packets give the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::drivers::emulate {

enum class FaultKind : std::uint8_t {
  kDrop,       // a byte is lost; rate: share of bytes
  kZero,       // a byte becomes 0; share of bytes
  kFlip,       // one bit of a byte flips; share of bytes
  kInsert,     // an extra byte is inserted; share of bytes
  kNoise,      // drop, flip or insert, equally often; share of bytes
  kDuplicate,  // a packet is sent twice; share of packets
  kSilence,    // half a packet, then nothing for a second; share of packets
  kBaud,       // half a second of bytes is received at another baud rate; share of packets
  kBurst,      // nothing for half a second, then everything at once; share of packets
  kCount
};

struct Fault {
  FaultKind kind = FaultKind::kNoise;
  double rate = 0.0;  // 0 to 1
};

// "KIND:RATE", such as "drop:0.01". An error names the kinds. Cold.
Result<Fault> parse_fault(std::string_view text);

class FaultInjector {
 public:
  using Bytes = std::vector<std::byte>;

  FaultInjector(Fault fault, std::uint64_t seed) noexcept : fault_(fault), random_(seed) {}

  // Passes a packet sent at `now_ns`: adds to `out` the bytes of it, or of earlier packets, that
  // arrive now. Returns true when it arrives unchanged.
  bool pass(std::span<const std::byte> packet, std::int64_t now_ns, Bytes& out);

 private:
  [[nodiscard]] bool strikes();
  bool pass_bytes(std::span<const std::byte> packet, Bytes& out);
  bool pass_packet(std::span<const std::byte> packet, std::int64_t now_ns, Bytes& out);
  // Adds a byte with this fault, or the byte and one inserted before it.
  void spoil(FaultKind kind, std::byte byte, Bytes& out);
  [[nodiscard]] std::byte any_byte() { return static_cast<std::byte>(random_() & 0xFF); }

  Fault fault_;
  std::mt19937_64 random_;
  std::int64_t until_ns_ = INT64_MIN;  // end of a fault that lasts for a time
  Bytes held_;                         // bytes held back during a burst
};

}  // namespace posed::drivers::emulate
