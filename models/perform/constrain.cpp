#include "models/perform/constrain.hpp"

#include <algorithm>
#include <limits>

#include "models/hand/constraint_solver.hpp"
#include "models/hand/geometry.hpp"

namespace posed::perform {

double smallest_gap_m(const Performance& performance, const HandShape& shape) {
  const hand::HandGeometry geometry = hand::hand_geometry(shape);
  double gap_m = std::numeric_limits<double>::infinity();
  for (const Pose& pose : performance.angles) {
    gap_m = std::min(gap_m, hand::min_gap_m(geometry, hand_of(pose)));
  }
  return gap_m;
}

ConstrainReport constrain(Performance& performance, const HandShape& shape) {
  ConstrainReport report;
  report.before_m = smallest_gap_m(performance, shape);
  hand::ConstraintSolver solver(hand::hand_geometry(shape));
  for (std::size_t t = 0; t < performance.angles.size(); ++t) {
    HandAngles pose = hand_of(performance.angles[t]);
    const auto step = solver.step(pose, hand_of(performance.variances[t]));
    performance.angles[t].assign(pose.begin(), pose.end());
    report.changed_rad = std::max(report.changed_rad, step.changed_rad);
  }
  report.min_gap_m = smallest_gap_m(performance, shape);
  return report;
}

}  // namespace posed::perform
