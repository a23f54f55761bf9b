// Synthetic walkers, for the demo and for tests that must run without recordings. Feet stand where
// they land (synthetic_gait.hpp); pelvis, trunk, head and arms follow the mean curves of real
// walks, and the legs reach for the feet. A person differs from others by sex, size, cadence,
// vigour and posture (models/motion/README.md, "Synthetic walkers").
#pragma once

#include <cstdint>

#include "proto/clip/clip.hpp"

namespace posed::motion {

enum class WalkerFamily : std::uint8_t {
  kMarch,  // upright, arms swing wide and straight, knees high
  kSway,   // hips roll and turn, feet on one line, arms quiet and held out
  kWalk,   // as people walk
  kSneak,  // bent knees and back, feet lifted with care, hands before the chest
  kTired,  // small slow steps, head and shoulders hang
};

struct WalkerOptions {
  WalkerFamily family = WalkerFamily::kMarch;
  std::uint32_t person = 1;  // seeds everything personal; one person can walk in every family
  double seconds = 6.0;
  double rate_hz = 30.0;
  double noise_deg = 0.3;  // white, of each rotation channel above the hips; feet do not tremble
  // In `seconds`, at least 12 strides of his: walks, turns about, stops, stands and starts, twice,
  // and is back where he began, so that the clip can be looped.
  bool round = false;
};

// A clip of one walk that begins towards +Z. Skeleton with BVH-style ZXY channels and canonical
// names; deterministic.
Result<clip::Clip> make_walker(const WalkerOptions& options);

}  // namespace posed::motion
