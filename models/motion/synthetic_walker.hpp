// Synthetic walkers: made-up people of two families, for the demo and for tests that must not need
// a recording. Each joint turns by a short Fourier series of the walking phase; a person differs
// from the family by a few degrees of carriage, by cadence, by leg length and by sensor noise. Not
// anatomy: enough for a style filter to have something true to learn, and the truth is known.
#pragma once

#include <cstdint>

#include "proto/clip/clip.hpp"

namespace posed::motion {

enum class WalkerFamily : std::uint8_t {
  kMarch,  // upright, wide arm swing, feet apart
  kSway,   // hips roll and turn, knees and feet close, arms quiet and held out
};

struct WalkerOptions {
  WalkerFamily family = WalkerFamily::kMarch;
  std::uint32_t person = 1;  // seeds everything personal; the same person walks in any family
  double seconds = 6.0;
  double rate_hz = 30.0;
  double noise_deg = 0.3;  // of each rotation channel, white
};

// A clip of one walk along +Z. Skeleton with BVH-style ZXY channels and canonical names;
// deterministic.
[[nodiscard]] Result<clip::Clip> make_walker(const WalkerOptions& options);

}  // namespace posed::motion
