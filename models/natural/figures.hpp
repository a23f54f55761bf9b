// The figures of one clip by which `eval natural` tells whether people move like that (README.md):
// how rough it is, which poses and changes it has, how far its joints turn, how its feet stand.
// Cold; thread-safe.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "models/motion/motion.hpp"
#include "models/motion/naturalness.hpp"
#include "models/task_numbers.hpp"
#include "proto/frame/result.hpp"

namespace posed::natural {

// The figures of a clip. Clips to compare have one rate and equal channels in equal order.
struct Figures {
  double jerk = 0.0;   // rms third difference of the angles, deg/frame^3
  double sparc = 0.0;  // spectral arc length of their speed; NaN if nothing moves
  motion::WindowSums windows;
  Eigen::VectorXd low_deg, high_deg;          // range of each channel
  std::optional<double> slide_cm_s, sink_cm;  // of bodies whose feet stand
};

// Measures angles [frames x channels], deg. Returns an error where they are too short for features.
Result<Figures> figures_of(const motion::Rows& angles_deg, double rate_hz);

// Measures a body at one rate by the rotation vectors of its joints about the means of `spec`.
// Returns an error for a skeleton that lacks joints of `spec`.
Result<Figures> figures_of(const motion::Motion& motion, const motion::PoseSpaceSpec& spec);

// Packs the figures as a task's numbers, behind those that `numbers` has, and reads them back.
void write(const Figures& figures, NumberWriter& numbers);
[[nodiscard]] Figures figures_from(NumberReader& numbers);

}  // namespace posed::natural
