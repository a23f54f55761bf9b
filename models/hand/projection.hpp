// The quadratic step of the constraint stage: the point nearest to a target, in a weighted metric,
// that satisfies linear constraints and lies in a box (models/hand/README.md, "Quadratic step").
// Solved in the dual: each constraint has a non-negative force, and forces are kept between calls
// as a warm start.
#pragma once

#include <array>
#include <span>

#include "models/hand/contacts.hpp"

namespace posed::hand {

inline constexpr int kMaxRows = 40;

// slope * y >= least, y the 45 angles; the slope touches two fingers only.
struct Row {
  int pair = 0;
  int finger_a = 0;
  int finger_b = 0;
  GapSlope slope;
  double least = 0.0;
};

using Forces = std::array<double, kBonePairs>;  // [pair]

struct Box {
  const HandAngles& low_rad;
  const HandAngles& high_rad;
};

// min (y - target)' diag(1/variance) (y - target) subject to all `rows` and, where `box` is given,
// to the box. Forces of pairs without a row are dropped.
RT_SAFE [[nodiscard]] HandAngles project(const HandAngles& target, const HandAngles& variance,
                                         std::span<const Row> rows, const Box* box,
                                         Forces& forces) noexcept;

}  // namespace posed::hand
