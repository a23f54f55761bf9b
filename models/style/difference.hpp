// From aligned cycles to the Gaussian process that adds a style: training pairs of (a source's
// cycle, its difference to the target), the choice of the kernel's length, and the fit (README.md,
// "Training pairs" and "Length of the kernel"). Cold.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "models/gp/regression.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

inline constexpr int kCycleHarmonics =
    4;                                  // mean and 4 harmonics describe a cycle down to its noise
inline constexpr int kGridFrames = 28;  // points of a cycle that the process is trained on

// One training pair of cycles, as harmonic coefficients [2 * kCycleHarmonics + 1 x D].
struct Pairing {
  Eigen::MatrixXd input;  // the walker's cycle of q
  Eigen::MatrixXd delta;  // what to add to it at the same phase
  bool prior = false;     // true for the first source, whose differences give the prior mean
};

// A walker held out while the kernel's length is chosen.
struct Fold {
  std::vector<Pairing> train;
  Eigen::MatrixXd q;      // frames of the walker [T x D]
  Eigen::MatrixXd truth;  // the true difference at these frames [T x D]
  // For measuring how much of the distance to the target is closed: the frames' phases, the
  // target's mean cycle and the constant part of the difference in `train` (one row). Without
  // phases it is not measured.
  Eigen::VectorXd phase{};
  Eigen::MatrixXd goal{};
  Eigen::RowVectorXd constant{};
};

// Distance of walkers' average cycles from the target's, as sums of squares over walkers, phases
// and dimensions: unchanged, with the process's change, and with a constant change.
struct Way {
  double before = 0.0, after = 0.0, constant = 0.0;

  [[nodiscard]] bool measured() const { return before > 0.0; }
  // The share of the distance that the change closes: 1 reaches the target, 0 has no effect, below
  // 0 leads away.
  [[nodiscard]] double closes() const;
  [[nodiscard]] double constant_closes() const;
  void add(const Way& other);
};

// The distance for frames q [T x D] at these phases; `change` [T x D] is what is added to them,
// `constant` [D] the constant offset to compare with, `goal` the target's cycle as harmonic
// coefficients.
[[nodiscard]] Way way_of(const Eigen::MatrixXd& q, const Eigen::VectorXd& phase,
                         const Eigen::MatrixXd& goal, const Eigen::MatrixXd& change,
                         const Eigen::RowVectorXd& constant);

// Kernel lengths to choose from [rad]: 30, 50, 75, 100 degrees for 63 dimensions, scaled by sqrt(D
// / 63) because distances grow with sqrt(D).
[[nodiscard]] std::vector<double> candidate_lengths_rad(int dims);

// The default model: prior mean = mean difference of the first source, an RBF of this length on the
// residual, b = 0, `noise` relative to the signal variance.
[[nodiscard]] Result<gp::Trained> fit_difference(const std::vector<Pairing>& training_pairs,
                                                 double length_rad, double noise);

// The method of Sato et al. (--mode paper; README.md, "What differs from the paper, measured"):
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

// Called after each fold with the fraction done; returning false stops the work.
using FoldProgress = std::function<bool(double fraction)>;

// The candidate with the least error over all folds; `fallback_rad` when there is no fold. When
// stopped early, the best so far.
[[nodiscard]] ChosenLength choose_length_rad(const std::vector<Fold>& folds,
                                             const std::vector<double>& candidates_rad,
                                             double noise, double fallback_rad,
                                             const FoldProgress& progress = {});

}  // namespace posed::style
