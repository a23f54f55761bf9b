// From aligned cycles to the process that adds a style: pairs of (a source's cycle, its difference
// to the target), the choice of the kernel's length, and the fit (algorithms.md 2.3, style-science
// 8). Cold.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "models/gp/regression.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

inline constexpr int kCycleHarmonics = 4;  // DC + 4 describe a cycle to its noise
inline constexpr int kGridFrames = 28;     // points of a cycle that the process is trained on

// One cycle that the process learns: as harmonic coefficients [2 * kCycleHarmonics + 1 x D].
struct Pairing {
  Eigen::MatrixXd input;  // the walker's cycle of q
  Eigen::MatrixXd delta;  // what to add to it at the same phase
  bool prior = false;     // counts for the prior mean: the first source
};

// A walker held out while the kernel's length is chosen.
struct Fold {
  std::vector<Pairing> train;
  Eigen::MatrixXd q;      // frames of the walker [T x D]
  Eigen::MatrixXd truth;  // what the process should say there [T x D]
};

// Kernel lengths to choose from [rad]: 30, 50, 75, 100 degrees for 63 dimensions, scaled by
// sqrt(D / 63) because distances grow so.
[[nodiscard]] std::vector<double> candidate_lengths_rad(int dims);

// The default model: prior mean = mean difference of the first source, an RBF of this length on
// what is left, b = 0, `noise` relative to the signal variance.
[[nodiscard]] Result<gp::Trained> fit_difference(const std::vector<Pairing>& pairings,
                                                 double length_rad, double noise);

// The paper's way (--mode paper): differences Y [N x D] at the mean cycle X [N x D], all kernel
// values by evidence (SCG).
[[nodiscard]] Result<gp::Trained> fit_paper(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y);

// Sum of squared errors on the fold's frames, and of the truth itself.
struct FoldError {
  double error = 0.0, truth = 0.0;
};
[[nodiscard]] FoldError fold_error(const Fold& fold, double length_rad, double noise);

// The candidate with the least error over all folds; `fallback_rad` when there is no fold.
[[nodiscard]] double choose_length_rad(const std::vector<Fold>& folds,
                                       const std::vector<double>& candidates_rad, double noise,
                                       double fallback_rad);

}  // namespace posed::style
