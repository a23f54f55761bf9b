// Applies the hand constraints to a whole performance: joint limits are kept and no finger goes
// through another (models/perform/README.md, "Constraints"). Cold.
#pragma once

#include "models/perform/perform.hpp"
#include "proto/frame/hand_shape.hpp"

namespace posed::perform {

struct ConstrainReport {
  double min_gap_m = 0.0;    // smallest gap between bones over all frames, afterwards
  double before_m = 0.0;     // the smallest gap beforehand; below zero: fingers overlapped
  double changed_rad = 0.0;  // largest change of an angle
};

// Uses the same solver as live, frame by frame, weighted by the performance's variances.
ConstrainReport constrain(Performance& performance, const HandShape& shape);

// The smallest gap between two bones over all frames [m].
[[nodiscard]] double smallest_gap_m(const Performance& performance, const HandShape& shape);

}  // namespace posed::perform
