// ConstrainStage: the constraint solver as the pipeline's last stage on a hand: joints keep their
// limits and fingers do not go through each other. Frames of another skeleton pass through. One
// thread.
#pragma once

#include <memory>

#include "models/hand/constraint_solver.hpp"
#include "models/stage.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::hand {

class ConstrainStage final : public Stage {
 public:
  // `skeleton` is a hand (hand_side() recognises it); its name selects the hand shape.
  explicit ConstrainStage(std::shared_ptr<const Skeleton> skeleton);

  // Moves the frame's angles to the nearest that are allowed; an angle that is known well moves
  // less. A hand that lacks an angle is left alone. RT-safe.
  void process(const StageFrame& in, StageOut& out) noexcept override;

 private:
  std::shared_ptr<const Skeleton> skeleton_;
  ConstraintSolver solver_;
};

}  // namespace posed::hand
