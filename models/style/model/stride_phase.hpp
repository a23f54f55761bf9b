// The phase of every frame of a walk whose cadence may change: strides are fitted in short windows
// and linked in time (README.md, "Stride"). Cold; thread-safe.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace posed::style {

struct StridePhase {
  Eigen::VectorXd phase;  // rad, one a frame, increasing: signal ~ A cos(phase)
  double dtheta = 0.0;    // mean cadence of `strides`, rad per frame
  // Share of the walk's signal that three harmonics of this phase leave, plus find_stride's penalty
  // on a weak first harmonic: 0 is a perfect stride, 1 and more none. Where the legs stand nothing
  // counts, unless they walk less than two strides.
  double score = 0.0;
  // The frames on which the legs stride, in order: without those that stand, start or stop, and
  // without a tenth of a second at either end of each walk, a third where a recording begins or
  // ends. All frames where less than a stride would be left.
  std::vector<Eigen::Index> strides;
};

// Follows the strides of a leg signal sampled at `rate_hz`: periods 0.6 to 2.6 s, no longer than
// the signal. Needs has_stride() (harmonics.hpp).
[[nodiscard]] StridePhase follow_strides(const Eigen::VectorXd& signal, double rate_hz);

// The frames of a walk that stride and their phases, turned so that the signal is A cos(phase).
struct WalkPhases {
  std::vector<Eigen::Index> frames;
  Eigen::VectorXd phase;  // [frames]
};
// Empty where the signal does not hold a whole stride.
[[nodiscard]] std::optional<WalkPhases> walk_phases(const Eigen::VectorXd& signal, double rate_hz);

}  // namespace posed::style
