// FaultInjector: what goes wrong between a glove and a host, put between an emulator and its link.
// Pure and repeatable: the same kind, rate, seed and packets give the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::drivers::emulate {

enum class FaultKind : std::uint8_t {
  kDrop,       // a byte is lost; rate: share of bytes
  kZero,       // a byte becomes 0; share of bytes
  kFlip,       // one bit of a byte flips; share of bytes
  kInsert,     // a byte comes in between; share of bytes
  kNoise,      // drop, flip or insert, each as often; share of bytes
  kDuplicate,  // a packet comes twice; share of packets
  kSilence,    // half a packet, then nothing for a second; share of packets
  kBaud,       // for half a second bytes are read at another baud rate; share of packets
  kBurst,      // nothing for half a second, then all of it at once; share of packets
  kCount
};

struct Fault {
  FaultKind kind = FaultKind::kNoise;
  double rate = 0.0;  // 0 to 1
};

// "KIND:RATE", such as "drop:0.01". An error names the kinds. Cold.
[[nodiscard]] Result<Fault> parse_fault(std::string_view text);
[[nodiscard]] std::vector<std::string_view> fault_names();

class FaultInjector {
 public:
  using Bytes = std::vector<std::byte>;

  FaultInjector(Fault fault, std::uint64_t seed) noexcept : fault_(fault), random_(seed) {}

  // The packet that is sent at `now_ns`: adds to `out` what arrives of it, or of earlier ones.
  // Whether it arrives as it was sent.
  bool pass(std::span<const std::byte> packet, std::int64_t now_ns, Bytes& out);

 private:
  [[nodiscard]] bool strikes();
  bool pass_bytes(std::span<const std::byte> packet, Bytes& out);
  bool pass_packet(std::span<const std::byte> packet, std::int64_t now_ns, Bytes& out);
  // A byte with this fault, or the byte and what was put before it.
  void spoil(FaultKind kind, std::byte byte, Bytes& out);
  [[nodiscard]] std::byte any_byte() { return static_cast<std::byte>(random_() & 0xFF); }

  Fault fault_;
  std::mt19937_64 random_;
  std::int64_t until_ns_ = INT64_MIN;  // how long a fault in time goes on
  Bytes held_;                         // of a burst
};

}  // namespace posed::drivers::emulate
