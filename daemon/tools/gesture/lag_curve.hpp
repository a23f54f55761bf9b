// How far a performance that knows its label sequence only some frames ahead is from one that knows
// all of it: as numbers and as a drawing.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "models/perform/perform.hpp"

namespace posed::tools {

struct LagPoint {
  int frames = 0;  // of look-ahead
  double rms_deg = 0.0, max_deg = 0.0;
  double jerk_ratio = 0.0;  // relative to the full solve
};

[[nodiscard]] std::vector<LagPoint> lag_curve(const trajectory::StateInformation& information,
                                              std::span<const int> labels);

// The curve as an SVG: look-ahead to the right, rms and largest error upwards on a log scale.
[[nodiscard]] std::string draw_lag_curve(std::span<const LagPoint> curve, double rate_hz);

}  // namespace posed::tools
