// From aligned cycles to the process that adds a style: pairs of (a source's cycle, its difference
// to the target), the choice of the kernel's length, and the fit (README.md, "Training pairs"
// and "Length of the kernel"). Cold.
#pragma once

#include <functional>
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
  // For the way that is left to the target: the frames' phases, the target's mean cycle and the
  // constant part of the difference that the others teach (one row). No phases: not measured.
  Eigen::VectorXd phase{};
  Eigen::MatrixXd goal{};
  Eigen::RowVectorXd constant{};
};

// How far walkers' average cycles are from the target's, as sums of squares over walkers, phases
// and dimensions: as they walk, with the process's change, with a constant one.
struct Way {
  double before = 0.0, after = 0.0, constant = 0.0;

  [[nodiscard]] bool measured() const { return before > 0.0; }
  // The share of the way that the change closes: 1 arrives, 0 helps nothing, below 0 leads away.
  [[nodiscard]] double closes() const;
  [[nodiscard]] double constant_closes() const;
  void add(const Way& other);
};

// Of frames q [T x D] at these phases; `change` [T x D] is what is added to them, `constant` [D]
// what a constant offset would add, `goal` the target's cycle as harmonic coefficients.
[[nodiscard]] Way way_of(const Eigen::MatrixXd& q, const Eigen::VectorXd& phase,
                         const Eigen::MatrixXd& goal, const Eigen::MatrixXd& change,
                         const Eigen::RowVectorXd& constant);

// Kernel lengths to choose from [rad]: 30, 50, 75, 100 degrees for 63 dimensions, scaled by
// sqrt(D / 63) because distances grow so.
[[nodiscard]] std::vector<double> candidate_lengths_rad(int dims);

// The default model: prior mean = mean difference of the first source, an RBF of this length on
// what is left, b = 0, `noise` relative to the signal variance.
[[nodiscard]] Result<gp::Trained> fit_difference(const std::vector<Pairing>& training_pairs,
                                                 double length_rad, double noise);

// The way of Sato et al. (--mode paper; README.md, "What differs from the paper, measured"):
// differences Y [N x D] at the mean cycle X [N x D], all kernel values by evidence (SCG).
[[nodiscard]] Result<gp::Trained> fit_paper(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y);

// Sum of squared errors on the fold's frames, and of the truth itself.
struct FoldError {
  double error = 0.0, truth = 0.0;
  Way way;
};
[[nodiscard]] FoldError fold_error(const Fold& fold, double length_rad, double noise);

struct ChosenLength {
  double length_rad = 0.0;
  Way way;  // of the walkers held out, with this length
};

// Called after each fold with the share of the work that is done; false stops it.
using FoldProgress = std::function<bool(double fraction)>;

// The candidate with the least error over all folds; `fallback_rad` when there is no fold. Stopped
// early, it is the best so far.
[[nodiscard]] ChosenLength choose_length_rad(const std::vector<Fold>& folds,
                                             const std::vector<double>& candidates_rad,
                                             double noise, double fallback_rad,
                                             const FoldProgress& progress = {});

}  // namespace posed::style
