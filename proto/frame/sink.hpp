// Sink: receives what a decoder makes of the bytes; Outcome: the possible results of decoding.
#pragma once

#include <cstdint>

#include "proto/frame/frame.hpp"

namespace posed {

// The result of decoding a piece of input. Each is counted per stream and published in `stats`.
enum class Outcome : std::uint8_t { kOk, kShort, kBadChecksum, kOutOfRange, kForeign, kCount };
inline constexpr int kOutcomes = static_cast<int>(Outcome::kCount);

// All calls are RT-safe and come from the one thread that feeds the decoder. The decoder fills what
// it knows (pose, device_ns, quality); the owner of the sink sets stream, sequence and arrival
// time.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;

  virtual void frame(Frame& frame) noexcept = 0;
  virtual void sample(Sample& sample) noexcept = 0;
  virtual void outcome(Outcome outcome) noexcept = 0;
};

}  // namespace posed
