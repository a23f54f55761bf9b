// PoseSolver: the pose of the robot that fits a target best, by damped Gauss-Newton steps within
// the joints' limits and with its links apart; no speeds here (models/robot/README.md, "Pose").
// Follows its own last pose. RT-safe, no heap.
#pragma once

#include "models/robot/hand_target.hpp"
#include "models/robot/shapes.hpp"
#include "models/robot/step_program.hpp"

namespace posed::robot {

class PoseSolver {
 public:
  // `robot` must outlive it.
  PoseSolver(const RobotHand& robot, double margin_m);

  RT_SAFE const Drive& solve(const HandTarget& target, int rounds) noexcept;
  RT_SAFE void restart(const Drive& pose) noexcept { pose_ = pose; }
  [[nodiscard]] const Drive& pose() const noexcept { return pose_; }

 private:
  // The cost of the pose that `placed_` shows; with H and g if wanted.
  RT_SAFE double cost(const HandTarget& target, const Drive& pose, bool slopes) noexcept;
  RT_SAFE double add_residual(const Drive& slope, double residual, double weight,
                              bool slopes) noexcept;
  RT_SAFE double add_points(const HandTarget& target, bool slopes) noexcept;
  RT_SAFE double add_pinches(const HandTarget& target, bool slopes) noexcept;
  struct Nearness {
    double overlap_m = 0.0;  // of the links that are deepest in each other
    double missing_m = 0.0;  // what pairs miss of their margin, together
  };
  RT_SAFE Nearness nearness(std::span<const Gap> gaps) const noexcept;
  RT_SAFE Nearness find_step(const Drive& turn, Drive& wanted) noexcept;
  RT_SAFE bool advance(const HandTarget& target, double before, const Nearness& now,
                       Drive& wanted) noexcept;
  RT_SAFE void look_ahead(const HandTarget& target, const Drive& wanted) noexcept;
  RT_SAFE bool step(const HandTarget& target) noexcept;

  const RobotHand& robot_;
  double margin_m_;
  Placed placed_;
  Gaps gaps_{};
  std::array<StepRow, 2 * kMaxGaps> rows_{};
  StepProgram program_;
  Drive pose_, middle_;
  Drive lately_ = Drive::Zero();  // what each joint has turned in a step
};

}  // namespace posed::robot
