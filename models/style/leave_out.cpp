#include "models/style/leave_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "models/gp/inducing.hpp"
#include "models/style/harmonics.hpp"
#include "proto/frame/degree.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::array kNoises{1e-3, 1e-2, 1e-1};
constexpr std::array kFirstLengths_deg{30.0, 50.0, 75.0, 100.0};
constexpr double kWiden = 1.5;          // from one length to the next beyond the first ones
constexpr double kShortest_deg = 10.0;  // a frame's own noise is of this size
constexpr double kLongest_deg = 400.0;  // a straight line over all poses
constexpr double kExplained = 1e-5;     // unexplained variance of a pose that needs no more poses
constexpr int kFoldPoses = 320;         // enough to compare kernels; the model itself has more
constexpr std::size_t kChunk = 8;  // folds a task; fixed, so that every machine has the same tasks
constexpr double kRoundShare = 0.8;  // of the progress that is left: another round may follow
constexpr std::size_t kNumbers = 4;  // that a task gives for a fold and a noise

// The process of one length on its inducing poses, ready to be asked without some of its inputs.
class Folded {
 public:
  Folded(const MatrixXd& X, double length_rad) : mu_(1.0 / (length_rad * length_rad)) {
    gp::Inducing chosen = gp::choose_inducing(X, mu_, kFoldPoses,
                                              [](int, double worst) { return worst < kExplained; });
    poses_ = X(chosen.chosen(), Eigen::all);
    root_ = chosen.root();
    factor_ = std::move(chosen.factor);
    gram_ = factor_.transpose() * factor_;
  }

  // For each noise: squared error a frame, then the three sums of Way.
  void ask(const Fold& fold, TaskResult& numbers) const {
    MatrixXd gram = gram_;
    MatrixXd residual = grid_outputs(fold.outputs).rowwise() - fold.outputs.offset;
    for (const int input : fold.left_out) {
      const auto rows = factor_.middleRows(input * kGridFrames, kGridFrames);
      gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose(), -1.0);
      residual.middleRows(input * kGridFrames, kGridFrames).setZero();
    }
    const MatrixXd moments = factor_.transpose() * residual;
    const MatrixXd near = gp::rbf(fold.q, poses_, 0.0, mu_);
    const MatrixXd truth = harmonic_basis(fold.phase, kCycleHarmonics) * fold.truth;
    for (const double noise : kNoises) {
      MatrixXd ridged = gram;
      ridged.diagonal().array() += noise;
      const MatrixXd solved = ridged.llt().solve(moments);
      const MatrixXd weights = root_.transpose().triangularView<Eigen::Upper>().solve(solved);
      const MatrixXd change = (near * weights).rowwise() + fold.outputs.offset;
      Way way;
      if (fold.goal.size() > 0) {
        way = way_of(fold.q, fold.phase, fold.goal, change, fold.truth.row(0));
      }
      const double error = (change - truth).squaredNorm() / static_cast<double>(fold.q.rows());
      numbers.insert(numbers.end(), {error, way.before, way.after, way.constant});
    }
  }

 private:
  double mu_;
  MatrixXd poses_, root_, factor_;
  MatrixXd gram_;  // of all inputs
};

double scaled_rad(double length_deg, Eigen::Index dims) {
  return length_deg * kDegree * std::sqrt(static_cast<double>(dims) / 63.0);
}

// Tries lengths on all folds and keeps the best kernel.
class Search {
 public:
  Search(const LeaveOut& leave_out, TaskRunner& tasks, const FoldProgress& progress)
      : leave_out_(leave_out),
        tasks_(tasks),
        progress_(progress),
        X_(grid_inputs(leave_out.pairs)),
        chunks_((leave_out.folds + kChunk - 1) / kChunk) {}

  // False when it was stopped.
  bool try_lengths(const std::vector<double>& lengths_deg) {
    const Task task = [&](std::size_t t) {
      const Folded process(X_, rad(lengths_deg[t / chunks_]));
      TaskResult numbers;
      const std::size_t first = t % chunks_ * kChunk;
      const std::size_t end = std::min(first + kChunk, leave_out_.folds);
      for (std::size_t f = first; f < end && !tasks_.stopping(); ++f) {
        process.ask(leave_out_.fold(f), numbers);
      }
      return numbers;
    };
    const std::size_t total = lengths_deg.size() * chunks_;
    const auto found = tasks_.run(total, task, [&](std::size_t done) {
      const double share = static_cast<double>(done) / static_cast<double>(total);
      return !progress_ || progress_(told_ + kRoundShare * share * (1.0 - told_));
    });
    if (!found) return false;
    told_ += kRoundShare * (1.0 - told_);
    for (std::size_t l = 0; l < lengths_deg.size(); ++l) {
      TaskResult numbers;
      for (std::size_t c = 0; c < chunks_; ++c) {
        const TaskResult& part = (*found)[l * chunks_ + c];
        numbers.insert(numbers.end(), part.begin(), part.end());
      }
      keep_best(lengths_deg[l], numbers);
    }
    return true;
  }

  [[nodiscard]] double best_deg() const { return best_deg_; }
  [[nodiscard]] const ChosenKernel& best() const { return best_; }

 private:
  [[nodiscard]] double rad(double length_deg) const { return scaled_rad(length_deg, X_.cols()); }

  void keep_best(double length_deg, const TaskResult& numbers) {
    const auto folds = static_cast<double>(leave_out_.folds);
    for (std::size_t n = 0; n < kNoises.size(); ++n) {
      ChosenKernel tried{{rad(length_deg), kNoises[n]}, 0.0, {}};
      for (std::size_t k = n * kNumbers; k < numbers.size(); k += kNumbers * kNoises.size()) {
        tried.error += numbers[k] / folds;  // each fold has equal weight, whatever its length
        tried.way.add({numbers[k + 1], numbers[k + 2], numbers[k + 3]});
      }
      if (!(tried.error < best_.error)) continue;
      best_ = tried;
      best_deg_ = length_deg;
    }
  }

  const LeaveOut& leave_out_;
  TaskRunner& tasks_;
  const FoldProgress& progress_;
  MatrixXd X_;
  std::size_t chunks_;
  double told_ = 0.0;  // progress at the end of the last round
  double best_deg_ = 0.0;
  ChosenKernel best_{{}, std::numeric_limits<double>::infinity(), {}};
};

}  // namespace

std::optional<ChosenKernel> choose_kernel(const LeaveOut& leave_out, TaskRunner& tasks,
                                          const FoldProgress& progress) {
  if (leave_out.folds == 0) {
    const auto dims = leave_out.pairs.inputs.front().cols();
    return ChosenKernel{{scaled_rad(50.0, dims), kNoises.front()}, 0.0, {}};
  }
  Search search(leave_out, tasks, progress);
  std::vector<double> lengths_deg(kFirstLengths_deg.begin(), kFirstLengths_deg.end());
  double shortest = lengths_deg.front();
  double longest = lengths_deg.back();
  while (!lengths_deg.empty()) {
    if (!search.try_lengths(lengths_deg)) return std::nullopt;
    lengths_deg.clear();
    if (search.best_deg() == shortest && shortest / kWiden >= kShortest_deg) {
      lengths_deg.push_back(shortest /= kWiden);
    } else if (search.best_deg() == longest && longest * kWiden <= kLongest_deg) {
      lengths_deg.push_back(longest *= kWiden);
    }
  }
  return search.best();
}

}  // namespace posed::style
