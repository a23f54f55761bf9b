// ConstraintSolver: the nearest pose of a hand that keeps its joints' limits and whose fingers do
// not go through each other. Nearest in the sense of the posterior: min (q - q0)' diag(1/variance)
// (q - q0), so that uncertain angles move first (models/hand/README.md, "Quadratic step"). A
// sequential QP: the distances of capsules are linearised, the QP is solved by dual Gauss-Seidel,
// begun from the forces of the frame before. An angle that comes near its limit is bent softly onto
// it first. Works on hand45 angles, so a left and a right hand are the same to it.
//
// State is one stream's: the forces and which pairs of bones touched. Const shape, no heap
// after the constructor. Not thread-safe.
#pragma once

#include <memory>

#include "models/hand/geometry.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_shape.hpp"

namespace posed::hand {

struct ConstraintOptions {
  bool limits = true;
  bool soft_limits = true;  // bend angles onto a limit; else they stop at it
  bool collisions = true;
  double margin_m = 0.2e-3;  // gap that is solved for, so that rounding leaves none below zero
  double leave_m = 0.5e-3;   // a pair that was held apart counts as touching until its gap is this
};

struct ConstraintReport {
  double min_gap_m = 0.0;    // of all pairs of bones after the step, at most 10 mm
  double changed_rad = 0.0;  // largest change of an angle
  int touching = 0;          // pairs that are held apart
  int rounds = 0;            // linearisations
  bool left_alone = false;   // an angle was not finite: nothing was changed, the gap is unknown
  bool retreated = false;    // no nearest pose was found; straightened until the fingers came apart
};

class ConstraintSolver {
 public:
  explicit ConstraintSolver(const HandShape& shape = default_hand_shape(),
                            const ConstraintOptions& options = {});
  // A hand of other make; limits and lengths are the geometry's.
  explicit ConstraintSolver(const HandGeometry& geometry, const ConstraintOptions& options = {});
  ~ConstraintSolver();
  ConstraintSolver(ConstraintSolver&&) noexcept;
  ConstraintSolver& operator=(ConstraintSolver&&) noexcept;

  // Changes `angles` [rad]. `variance` [rad^2] weights them; a value that is not finite or not
  // above zero counts as one degree squared. The gap afterwards is at least zero whatever the input
  // was, as long as it was finite. RT-safe.
  ConstraintReport step(HandAngles& angles, const HandAngles& variance) noexcept;

  // Forgets the frame before (a gap in the stream, another source). RT-safe.
  void reset() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Smallest gap between bones of two fingers [m], at most 10 mm; below zero where they overlap.
// RT-safe.
[[nodiscard]] double min_gap_m(const HandGeometry& geometry, const HandAngles& angles) noexcept;

}  // namespace posed::hand
