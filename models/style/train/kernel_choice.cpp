#include "models/style/train/kernel_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "models/gp/inducing.hpp"
#include "models/style/model/harmonics.hpp"
#include "proto/frame/degree.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::array kNoises{1e-3, 1e-2, 1e-1};
constexpr std::array kFirstLengths_deg{30.0, 50.0, 75.0, 100.0};
constexpr double kUsualLength_deg = 50.0;
constexpr double kWiden = 1.5;            // from one length to the next beyond the first ones
constexpr double kMinLength_deg = 10.0;   // a frame's own noise is of this size
constexpr double kMaxLength_deg = 400.0;  // a straight line over all poses
constexpr double kExplained = 1e-5;       // unexplained variance of a pose that needs no more poses
constexpr int kFoldPoses = 320;           // enough to compare kernels; the model itself has more
constexpr std::size_t kChunk = 8;  // folds a task; fixed, so that every machine has the same tasks
constexpr double kRoundShare = 0.8;  // of the progress that is left: another round may follow
constexpr std::size_t kNumbers = 4;  // that a task gives for a fold and a noise

// The process of one length on its inducing poses, ready to be asked without some of its inputs.
class Folded {
 public:
  Folded(const MatrixXd& X, const VectorXd& scale, double length_rad)
      : mu_(1.0 / (length_rad * length_rad)), scale_(scale) {
    gp::Inducing chosen =
        gp::choose_inducing(X, mu_, kFoldPoses, [](double worst) { return worst < kExplained; });
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
    const MatrixXd near = gp::rbf(scaled(fold.q, scale_), poses_, 0.0, mu_);
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
  VectorXd scale_;
  MatrixXd poses_, root_, factor_;
  MatrixXd gram_;  // of all inputs
};

double scaled_rad(double length_deg, const TrainingPairs& pairs) {
  const double dims = pairs.scale.size() == 0 ? static_cast<double>(pairs.inputs.front().cols())
                                              : pairs.scale.squaredNorm();
  return length_deg * kDegree * std::sqrt(dims / 63.0);
}

// Folds of one style that share a task.
struct Chunk {
  std::size_t style;
  std::size_t first, end;  // of its folds
};

std::vector<Chunk> chunks_of(std::span<const LeaveOut> styles) {
  std::vector<Chunk> chunks;
  for (std::size_t s = 0; s < styles.size(); ++s) {
    const std::size_t folds = styles[s].folds;
    for (std::size_t first = 0; first < folds; first += kChunk) {
      chunks.push_back({s, first, std::min(first + kChunk, folds)});
    }
  }
  return chunks;
}

// Tries lengths on all folds and keeps the best kernel.
class Search {
 public:
  Search(std::span<const LeaveOut> styles, TaskRunner& tasks, const FoldProgress& progress)
      : styles_(styles), tasks_(tasks), progress_(progress), chunks_(chunks_of(styles)) {
    for (const LeaveOut& style : styles) X_.push_back(grid_inputs(style.pairs));
  }

  // Only the usual noise from now on.
  void keep_noise() { noises_ = 1; }

  // False when it was stopped.
  bool try_lengths(const std::vector<double>& lengths_deg) {
    const Task task = [&](std::size_t t) {
      const Chunk& chunk = chunks_[t % chunks_.size()];
      const Folded process(X_[chunk.style], styles_[chunk.style].pairs.scale,
                           rad(lengths_deg[t / chunks_.size()]));
      TaskResult numbers;
      const LeaveOut& style = styles_[chunk.style];
      for (std::size_t f = chunk.first; f < chunk.end && !tasks_.stopping(); ++f) {
        process.ask(style.fold(f), numbers);
      }
      return numbers;
    };
    const std::size_t total = lengths_deg.size() * chunks_.size();
    const auto found = tasks_.run(total, task, [&](std::size_t done) {
      const double share = static_cast<double>(done) / static_cast<double>(total);
      return !progress_ || progress_(reported_ + kRoundShare * share * (1.0 - reported_));
    });
    if (!found) return false;
    reported_ += kRoundShare * (1.0 - reported_);
    for (std::size_t l = 0; l < lengths_deg.size(); ++l) {
      keep_best(lengths_deg[l], std::span(*found).subspan(l * chunks_.size(), chunks_.size()));
    }
    return true;
  }

  [[nodiscard]] double best_deg() const { return best_deg_; }
  [[nodiscard]] ChosenKernel best() && {
    best_.tried = std::move(tried_);
    return std::move(best_);
  }

 private:
  [[nodiscard]] double rad(double length_deg) const {
    return scaled_rad(length_deg, styles_.front().pairs);
  }

  // `found`: one result a chunk.
  void keep_best(double length_deg, std::span<const TaskResult> found) {
    std::size_t folds = 0;
    for (const LeaveOut& style : styles_) folds += style.folds;
    for (std::size_t n = 0; n < noises_; ++n) {
      ChosenKernel tried{
          {rad(length_deg), kNoises[n]}, 0.0, std::vector<std::vector<Way>>(styles_.size()), {}};
      for (std::size_t c = 0; c < found.size(); ++c) {
        const TaskResult& numbers = found[c];
        for (std::size_t k = n * kNumbers; k < numbers.size(); k += kNumbers * kNoises.size()) {
          // Each fold has equal weight, whatever its length.
          tried.error += numbers[k] / static_cast<double>(folds);
          tried.folds[chunks_[c].style].push_back({numbers[k + 1], numbers[k + 2], numbers[k + 3]});
        }
      }
      tried_.push_back({tried.kernel, tried.error});
      if (!(tried.error < best_.error)) continue;
      best_ = std::move(tried);
      best_deg_ = length_deg;
    }
  }

  std::span<const LeaveOut> styles_;
  TaskRunner& tasks_;
  const FoldProgress& progress_;
  std::vector<Chunk> chunks_;
  std::vector<MatrixXd> X_;              // of each style
  std::size_t noises_ = kNoises.size();  // that are tried, from the first on
  double reported_ = 0.0;                // progress at the end of the last round
  double best_deg_ = 0.0;
  ChosenKernel best_{{}, std::numeric_limits<double>::infinity(), {}, {}};
  std::vector<TriedKernel> tried_;
};

}  // namespace

Way ChosenKernel::way(std::size_t style) const {
  Way sum;
  for (const Way& fold : folds[style]) sum.add(fold);
  return sum;
}

std::optional<ChosenKernel> choose_kernel(std::span<const LeaveOut> styles, TaskRunner& tasks,
                                          const FoldProgress& progress) {
  if (std::ranges::all_of(styles, [](const LeaveOut& style) { return style.folds == 0; })) {
    return ChosenKernel{{scaled_rad(kUsualLength_deg, styles.front().pairs), kNoises.front()},
                        0.0,
                        std::vector<std::vector<Way>>(styles.size()),
                        {}};
  }
  Search search(styles, tasks, progress);
  if (std::ranges::all_of(styles, [](const LeaveOut& s) { return s.halves || s.folds == 0; })) {
    search.keep_noise();
    if (!search.try_lengths({kUsualLength_deg})) return std::nullopt;
    return std::move(search).best();
  }
  std::vector<double> lengths_deg(kFirstLengths_deg.begin(), kFirstLengths_deg.end());
  double shortest = lengths_deg.front();
  double longest = lengths_deg.back();
  while (!lengths_deg.empty()) {
    if (!search.try_lengths(lengths_deg)) return std::nullopt;
    lengths_deg.clear();
    if (search.best_deg() == shortest && shortest / kWiden >= kMinLength_deg) {
      lengths_deg.push_back(shortest /= kWiden);
    } else if (search.best_deg() == longest && longest * kWiden <= kMaxLength_deg) {
      lengths_deg.push_back(longest *= kWiden);
    }
  }
  return std::move(search).best();
}

}  // namespace posed::style
