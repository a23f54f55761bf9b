// Synthetic walkers of two families, for the demo and for tests that must run without recordings.
// Each joint turns by a short Fourier series of the walking phase; a person differs from the family
// by a few degrees of posture, by cadence, by leg length and by sensor noise. The walkers are not
// anatomically correct, but they give a style filter something to learn whose truth is known
// (README.md, "Synthetic walkers").
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
  std::uint32_t person = 1;  // seeds everything personal; one person can walk in either family
  double seconds = 6.0;
  double rate_hz = 30.0;
  double noise_deg = 0.3;  // of each rotation channel, white
};

// A clip of one walk along +Z. Skeleton with BVH-style ZXY channels and canonical names;
// deterministic.
Result<clip::Clip> make_walker(const WalkerOptions& options);

}  // namespace posed::motion
