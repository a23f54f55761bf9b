// The figures of one clip by which `eval natural` tells whether people move like that (README.md):
// how rough it is, which poses and changes it has, how far its joints turn, how its feet stand.
// Cold; thread-safe.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "models/motion/motion.hpp"
#include "models/motion/naturalness.hpp"
#include "models/tasks.hpp"
#include "proto/frame/result.hpp"

namespace posed::natural {

// Of clips at one rate, with the same channels in the same order.
struct Figures {
  double jerk = 0.0;   // rms third difference of the angles, deg/frame^3
  double sparc = 0.0;  // spectral arc length of their speed; NaN if nothing moves
  motion::WindowSums windows;
  Eigen::VectorXd low_deg, high_deg;          // range of each channel
  std::optional<double> slide_cm_s, sink_cm;  // of bodies whose feet stand
};

// Of angles [frames x channels], deg. An error where they are too short for features.
[[nodiscard]] Result<Figures> figures_of(const motion::Rows& angles_deg, double rate_hz);

// Of a body at one rate: rotation vectors of the joints about the means of `spec`. An error for a
// skeleton that lacks joints of `spec`.
[[nodiscard]] Result<Figures> figures_of(const motion::Motion& motion,
                                         const motion::PoseSpaceSpec& spec);

// As a task's numbers, and back.
[[nodiscard]] TaskResult numbers_of(const Figures& figures);
[[nodiscard]] Figures figures_from(const TaskResult& numbers);

}  // namespace posed::natural
