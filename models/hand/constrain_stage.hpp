// ConstrainStage: the constraint solver as the pipeline's last stage on a hand: fingers keep their
// limits and do not go through each other. Frames of another skeleton pass through.
#pragma once

#include <memory>

#include "models/hand/constraint_solver.hpp"
#include "models/stage.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::hand {

class ConstrainStage final : public Stage {
 public:
  // `skeleton` is a hand's (hand_side() knows it); the shape that it is named after is used.
  explicit ConstrainStage(std::shared_ptr<const Skeleton> skeleton);

  // Moves the frame's angles to the nearest that are allowed; an angle that is known well moves
  // less. A hand that lacks an angle is left alone. RT-safe.
  void process(const StageFrame& in, StageOut& out) noexcept override;

 private:
  std::shared_ptr<const Skeleton> skeleton_;
  ConstraintSolver solver_;
};

}  // namespace posed::hand
