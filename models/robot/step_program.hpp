// The quadratic program of a step: min 1/2 d'Hd + g'd with d in a box and a few linear rows. Dual:
// the sides of the box and the rows that the free step breaks get non-negative forces
// (models/hand/nonnegative.hpp); others join them until none is broken. Knows nothing of hands.
// RT-safe, no heap.
#pragma once

#include <span>

#include "models/robot/robot_hand.hpp"

namespace posed::robot {

using Metric = Eigen::Matrix<double, kMaxDriven, kMaxDriven>;

struct StepRow {  // slope . d >= least
  Drive slope = Drive::Zero();
  double least = 0.0;
};

struct StepProgram {
  int size = 0;  // of the first of the coordinates, which alone matter
  Metric H = Metric::Identity();
  Drive g = Drive::Zero();
  Drive low = Drive::Zero(), high = Drive::Zero();
  std::span<const StepRow> rows;
};

// `step` lies in the box exactly. False: the rows cannot all be kept, and it breaks some.
RT_SAFE [[nodiscard]] bool solve(const StepProgram& program, Drive& step) noexcept;

}  // namespace posed::robot
