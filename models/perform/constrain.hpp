// A performance through the constraint stage: joint limits kept, no finger through another. Cold.
#pragma once

#include "models/perform/perform.hpp"
#include "proto/frame/hand_shape.hpp"

namespace posed::perform {

struct ConstrainReport {
  double min_gap_m = 0.0;    // between any two bones, of all frames after it
  double before_m = 0.0;     // the same before it; below zero: fingers overlapped
  double changed_rad = 0.0;  // largest change of an angle
};

// The same solver as live, frame after frame, weighted by the performance's variances.
ConstrainReport constrain(Performance& performance, const HandShape& shape);

// The smallest gap between two bones over all frames [m].
[[nodiscard]] double smallest_gap_m(const Performance& performance, const HandShape& shape);

}  // namespace posed::perform
