// What posed's robot hands are compared with: the objective of DexPilot (Handa et al. 2020) with
// the constants of dex-retargeting, written anew. Vectors from the wrist to the tips and between
// the tips are scaled; a thumb and a finger that come nearer than 30 mm are drawn together until
// they are 50 mm apart again. Limits of joints are widened by 0.001 rad and those of followers
// ignored, as there. Solved to its optimum by our quadratic program, so that only the objective
// differs; the palm's frame is that which we derive.
#pragma once

#include <vector>

#include "models/hand/geometry.hpp"
#include "models/robot/step_program.hpp"

namespace posed::bench {

class DexPilot {
 public:
  // `robot` must outlive it.
  DexPilot(const robot::RobotHand& robot, const hand::HandGeometry& person);

  const robot::Drive& solve(const HandAngles& angles);

 private:
  struct Vector {
    int from = 0, to = 0;  // links of the robot
    int a = -1, b = 0;     // fingers; -1: the wrist
    bool projected = false;
    double weight = 1.0;
    Eigen::Vector3d target_m = Eigen::Vector3d::Zero();
  };
  void find_targets(const HandAngles& angles);
  void guess_wrist();
  [[nodiscard]] Eigen::Vector3d to_robot(const Eigen::Vector3d& person) const;
  double cost(const robot::Drive& pose, bool slopes);
  bool step();

  const robot::RobotHand& robot_;
  hand::HandGeometry person_;
  double scale_ = 0.0;
  Eigen::Vector3d wrist_m_ = Eigen::Vector3d::Zero();  // in the root's frame
  std::vector<Vector> vectors_;
  robot::Placed placed_;
  robot::StepProgram program_;
  robot::Drive pose_, last_;
};

}  // namespace posed::bench
