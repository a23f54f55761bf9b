// The phase of every frame of a walk whose cadence may change: strides are fitted in short windows
// and linked in time (models/style/README.md, "Stride"). Cold; thread-safe.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace posed::style {

struct StridePhase {
  Eigen::VectorXd phase;  // rad, one a frame, increasing: signal ~ A cos(phase)
  double dtheta = 0.0;    // mean cadence of `strides`, rad per frame
  // Share of the walk's variance that three harmonics of this phase do not explain, plus
  // weak_first_penalty(): 0 is a perfect stride, 1 or more none. Frames in which the legs stand do
  // not count, unless the rest has less than two strides.
  double score = 0.0;
  // The frames in which the legs stride, ascending. Left out are frames that stand, start or stop,
  // 0.1 s at either end of each walk, and 0.33 s at either end of a signal of more than 2.2 s. All
  // frames, if less than a stride would be left.
  std::vector<Eigen::Index> strides;
};

// Follows the strides of a leg signal (LegSignal) [frames], whose periods are 0.6 to 2.6 s and no
// longer than the signal. Needs has_stride() (harmonics.hpp).
[[nodiscard]] StridePhase follow_strides(const Eigen::VectorXd& signal, double rate_hz);

// StridePhase::strides and their phases [rad], shifted so that the signal is A cos(phase).
struct WalkPhases {
  std::vector<Eigen::Index> frames;
  Eigen::VectorXd phase;  // [frames]
};
// Empty where the signal does not hold a whole stride.
[[nodiscard]] std::optional<WalkPhases> walk_phases(const Eigen::VectorXd& signal, double rate_hz);

}  // namespace posed::style
