// Sink: receives what a decoder makes of the bytes; Outcome: the possible results of decoding.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "proto/frame/frame.hpp"

namespace posed {

// The result of decoding a piece of input. Each is counted per stream and published in `stats`.
enum class Outcome : std::uint8_t {
  kOk,
  kShort,
  kBadChecksum,
  kOutOfRange,
  kForeign,
  kLate,       // a newer datagram overtook it on the network
  kDuplicate,  // the network delivered it twice
  kCount
};
inline constexpr int kOutcomes = static_cast<int>(Outcome::kCount);
inline constexpr std::array<std::string_view, kOutcomes> kOutcomeNames{
    "ok", "short", "bad_checksum", "out_of_range", "foreign", "late", "duplicate"};

inline constexpr std::size_t kMaxBodies = 64;  // one source has at most so many
// In bytes; a decoder reports no longer description.
inline constexpr std::size_t kMaxDescription = 256 * 1024;

// All calls are RT-safe and come from the one thread that feeds the decoder. The decoder fills what
// it knows (pose, device_ns, quality); the owner of the sink sets stream, sequence and arrival
// time.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;

  // `body` is an index into the bodies of the source, below kMaxBodies.
  virtual void frame(std::size_t body, Frame& frame) noexcept = 0;
  virtual void sample(std::size_t body, Sample& sample) noexcept = 0;
  virtual void outcome(Outcome outcome) noexcept = 0;

  // The device has described its bodies anew, perhaps as before: the whole description, in the
  // device's own format. The callee copies what it keeps. Sinks of one-body devices ignore it.
  virtual void description(std::span<const std::byte> /*bytes*/) noexcept {}

  // For a device with one body.
  void frame(Frame& one) noexcept { frame(0, one); }
  void sample(Sample& one) noexcept { sample(0, one); }
};

}  // namespace posed
