// The choice of the kernel by its error on held-out walkers: each fold asks a process that was
// trained without some clips for the difference on a clip's own frames. The folds of one task, up
// to 8 of one length, share the kernel's factor (models/style/train/README.md, "Choice of the
// kernel"). Cold; thread-safe.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "models/style/train/difference_process.hpp"
#include "models/tasks.hpp"

namespace posed::style {

struct Fold {
  std::vector<int> left_out;  // inputs that are not learnt from
  Outputs outputs;            // as the other inputs show them; those of `left_out` do not count
  Eigen::MatrixXd truth;      // harmonic coefficients of the difference that the frames should get
  Eigen::MatrixXd q;          // the walker's frames [T x D]
  Eigen::VectorXd phase;      // of these frames
  Eigen::MatrixXd goal{};     // the cycle that they should reach; empty: Way is not measured
};

// The walker that a fold asks, for the report.
struct HeldOut {
  std::string file, person;
  int clips = 0;  // that are not learnt from
};

struct LeaveOut {
  TrainingPairs pairs;
  std::size_t folds = 0;  // how many
  // Fold `index`. Built where it is used, because all together may take gigabytes; called from any
  // thread.
  std::function<Fold(std::size_t index)> fold{};
  std::vector<HeldOut> held_out{};  // [fold]
  bool halves = false;  // of clips: they measure a kernel, but one take each chooses none
};

// A kernel, and the mean squared error of a frame's difference, rad^2 summed over dimensions.
struct TriedKernel {
  Kernel kernel;
  double error = 0.0;
};

// A kernel and how it did on the folds.
struct ChosenKernel {
  Kernel kernel;
  double error = 0.0;
  std::vector<std::vector<Way>> folds{};  // [style][fold]: of each walker held out
  std::vector<TriedKernel> tried{};       // all, in the order in which they were tried

  // The distance summed over all walkers that were held out for one style.
  [[nodiscard]] Way way(std::size_t style) const;
};

// Receives the fraction done; returning false stops the work.
using FoldProgress = std::function<bool(double fraction)>;

// The best of all combinations of lengths and noises: 30 to 100 degrees, and on while the best is
// at an edge; noise over signal 1e-3 to 0.1. `styles` share the kernel: each asks its own folds,
// all of which count alike. Without folds, and where all are halves, 50 degrees and 1e-3. Nothing
// when `progress` asked to stop.
[[nodiscard]] std::optional<ChosenKernel> choose_kernel(std::span<const LeaveOut> styles,
                                                        TaskRunner& tasks,
                                                        const FoldProgress& progress);
[[nodiscard]] inline std::optional<ChosenKernel> choose_kernel(const LeaveOut& style,
                                                               TaskRunner& tasks,
                                                               const FoldProgress& progress) {
  return choose_kernel(std::span(&style, 1), tasks, progress);
}

}  // namespace posed::style
