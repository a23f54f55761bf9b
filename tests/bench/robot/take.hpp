// Takes of hands for the figures of robot hands: 45 angles [rad] at 120 Hz, within the limits of a
// hand and with its fingers apart, as a stream's constraints leave them. Cold.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::bench {

inline constexpr double kTakeRate_hz = 120.0;

struct HandTake {
  std::string name;
  std::vector<HandAngles> angles;  // [frame]
};

// A made-up hand that pinches with each finger twice, points, spreads, makes a fist; it holds each
// for half a second.
HandTake synthetic_take();

// Any file of a hand that posed reads.
Result<HandTake> read_take(const std::filesystem::path& path);

// The signs of LIBRAS in which the thumb touches a finger, with a CyberGlove's map: from one to the
// next in half a second, held as long. `folder` holds a CSV a sign.
Result<HandTake> signs_take(const std::filesystem::path& folder);

}  // namespace posed::bench
