// ConstraintSolver: finds the nearest pose of a hand that keeps its joints' limits and whose
// fingers do not go through each other. Distances are weighted by the posterior: min (q - q0)'
// diag(1/variance) (q - q0), so that uncertain angles move first (models/hand/README.md, "Quadratic
// step"). It is a sequential QP: the distances of capsules are linearised and the QP is solved by
// dual Gauss-Seidel, started from the forces of the previous frame. An angle near its limit is
// first bent softly onto it. Works on hand45 angles, which have the same meaning for left and right
// hands.
//
// The state belongs to one stream: the forces and which pairs of bones touched. The shape is
// constant; no heap after the constructor. Not thread-safe.
#pragma once

#include <memory>

#include "models/hand/geometry.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_shape.hpp"

namespace posed::hand {

struct ConstraintOptions {
  bool limits = true;
  bool soft_limits = true;  // bend angles onto a limit; false: clamp them
  bool collisions = true;
  double margin_m = 0.2e-3;  // target gap, so that rounding leaves no gap below zero; at least 1e-5
  double leave_m = 0.5e-3;   // a pair that was held apart counts as touching up to this gap
};

struct ConstraintReport {
  double min_gap_m = 0.0;    // of all pairs of bones after the step, at most 10 mm
  double changed_rad = 0.0;  // largest change of an angle
  int touching = 0;          // number of pairs that are held apart
  int rounds = 0;            // linearisations
  bool left_alone = false;   // an angle is not finite: nothing is changed, the gap is unknown
  bool retreated =
      false;  // no nearest pose was found; the fingers were straightened until they came apart
};

class ConstraintSolver {
 public:
  explicit ConstraintSolver(const HandShape& shape = default_hand_shape(),
                            const ConstraintOptions& options = {});
  // For a hand of any other geometry, which gives limits and lengths.
  explicit ConstraintSolver(const HandGeometry& geometry, const ConstraintOptions& options = {});
  ~ConstraintSolver();
  ConstraintSolver(ConstraintSolver&&) noexcept;
  ConstraintSolver& operator=(ConstraintSolver&&) noexcept;

  // Changes `angles` [rad]. `variance` [rad^2] weights them; a value that is not finite or not
  // above zero counts as one degree squared. The gap afterwards is at least zero for any finite
  // input.
  RT_SAFE ConstraintReport step(HandAngles& angles, const HandAngles& variance) noexcept;

  // Forgets the previous frame; call it after a gap in the stream or at a change of source.
  RT_SAFE void reset() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Smallest gap between bones of two fingers [m], at most 10 mm; below zero where they overlap.
RT_SAFE [[nodiscard]] double min_gap_m(const HandGeometry& geometry,
                                       const HandAngles& angles) noexcept;

}  // namespace posed::hand
