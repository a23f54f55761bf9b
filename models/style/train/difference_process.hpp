// From aligned cycles to the Gaussian process that adds a style: training pairs of (a source's
// cycle, its difference to the target), and the fit (models/style/train/README.md, "Training
// pairs"). Cold.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "models/gp/regression.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

// The most poses that a process keeps; above it they are inducing poses (models/gp/inducing.hpp).
inline constexpr int kMaxPoses = 800;

inline constexpr int kNoDifference = -1;

// What to add to each input at the same phase. Cycles and differences are harmonic coefficients
// [2 * kCycleHarmonics + 1 x D].
struct Outputs {
  std::vector<int> of_input;  // an index into `differences`, or kNoDifference to add nothing
  std::vector<Eigen::MatrixXd> differences;
  Eigen::RowVectorXd offset;  // [D] the process's prior mean, which it gives far from all poses
};

// The data that a process is trained on.
struct TrainingPairs {
  std::vector<Eigen::MatrixXd> inputs;  // cycles
  Outputs outputs;
  Eigen::VectorXd scale{};  // of the inputs' dimensions in the kernel [D]; empty: all 1
};

// Length of the kernel [rad] and noise over signal variance.
struct Kernel {
  double length_rad = 0.0, noise = 1e-3;
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

// The inputs' poses on the cycle's grid [kGridFrames * inputs x D] as the kernel measures them, and
// what to add to each.
[[nodiscard]] Eigen::MatrixXd scaled(const Eigen::MatrixXd& poses, const Eigen::VectorXd& scale);
[[nodiscard]] Eigen::MatrixXd grid_inputs(const TrainingPairs& pairs);
[[nodiscard]] Eigen::MatrixXd grid_outputs(const Outputs& outputs);

// The default model: the offset as prior mean, an RBF of this length on the residual, b = 0, the
// noise relative to the signal variance; at most kMaxPoses poses.
Result<gp::Trained> fit_difference(const TrainingPairs& pairs, const Kernel& kernel);

// The training data of one of several styles in one model.
struct StylePairs {
  TrainingPairs pairs;
  std::vector<int> clips;  // whose cycles are its inputs, among all clips
};

// Fits several styles that share kernel and poses: each is trained on its own pairs. The
// poses are chosen among the `cycles` of all clips, as many as the largest style alone would have.
Result<std::vector<gp::Trained>> fit_differences(std::span<const StylePairs> styles,
                                                 const std::vector<Eigen::MatrixXd>& cycles,
                                                 const Kernel& kernel);

// The method of Sato et al. (--mode paper; models/style/train/README.md, "What differs from the
// paper, measured"): differences Y [N x D] at the mean cycle X [N x D], all kernel values by
// evidence (SCG). The search for them takes seconds; once `stop` (may be empty) returns true, it
// gives the best so far.
[[nodiscard]] gp::Hyper paper_kernel(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                                     const std::function<bool()>& stop = {});
Result<gp::Trained> fit_paper(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                              const gp::Hyper& kernel);

}  // namespace posed::style
