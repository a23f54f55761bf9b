// ConstrainStage: the constraint solver as the pipeline's last stage on a hand: joints keep their
// limits and fingers do not go through each other. Frames of another skeleton pass through. One
// thread.
#pragma once

#include <memory>
#include <span>

#include "models/hand/constraint_solver.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::hand {

class ConstrainStage {
 public:
  // `skeleton` is a hand (hand_side() recognises it); its name selects the hand shape.
  explicit ConstrainStage(std::shared_ptr<const Skeleton> skeleton);

  // Moves the frame's angles to the nearest allowed pose. `variance_rad2` has the posterior
  // variance of each rotation channel; empty: all angles have the same weight. A frame that lacks
  // an angle is not changed. RT-safe.
  void step(Frame& frame, std::span<const double> variance_rad2) noexcept;

 private:
  std::shared_ptr<const Skeleton> skeleton_;
  ConstraintSolver solver_;
};

}  // namespace posed::hand
