#include "models/style/difference.hpp"

#include <cmath>
#include <limits>

#include "models/style/harmonics.hpp"
#include "proto/frame/degree.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// 1e-3 deg^2, that is (0.03 degrees)^2: no joint angle is known more precisely. MGPM cycles contain
// no noise of their own.
constexpr double kMinNoise_rad2 = 3.05e-7;

// Start of the search for the kernel values of --mode paper: the data's own variance, length 50
// degrees, little noise.
gp::Hyper paper_start(const MatrixXd& Y) {
  constexpr double kLength_rad = 50.0 * kDegree;
  const Eigen::RowVectorXd mean = Y.colwise().mean();
  const double variance = (Y.rowwise() - mean).squaredNorm() / static_cast<double>(Y.size());
  const double constant = mean.squaredNorm() / static_cast<double>(mean.size());
  return {.lambda = std::log(std::max(variance, 1e-9)),
          .log_mu = -2.0 * std::log(kLength_rad),
          .log_b = std::log(std::max(constant, 1e-9)),
          .log_noise = std::log(1e-2 * std::max(variance, 1e-9))};
}

struct Grid {
  MatrixXd inputs, outputs;  // [kGridFrames * training_pairs x D]
  VectorXd offset;           // [D]
};

Grid grid_of(const std::vector<Pairing>& training_pairs) {
  const MatrixXd basis = harmonic_basis(cycle_phases(kGridFrames), kCycleHarmonics);
  const auto dims = training_pairs.front().input.cols();
  const auto rows = static_cast<Eigen::Index>(training_pairs.size()) * kGridFrames;
  Grid grid{MatrixXd(rows, dims), MatrixXd(rows, dims), VectorXd::Zero(dims)};
  int counted = 0;
  for (Eigen::Index i = 0; i < std::ssize(training_pairs); ++i) {
    const Pairing& pairing = training_pairs[static_cast<std::size_t>(i)];
    grid.inputs.middleRows(i * kGridFrames, kGridFrames) = basis * pairing.input;
    grid.outputs.middleRows(i * kGridFrames, kGridFrames) = basis * pairing.delta;
    if (pairing.prior) {
      grid.offset += pairing.delta.row(0).transpose();
      ++counted;
    }
  }
  if (counted > 0) grid.offset /= counted;
  return grid;
}

}  // namespace

std::vector<double> candidate_lengths_rad(int dims) {
  std::vector<double> lengths;
  for (const double length_deg : {30.0, 50.0, 75.0, 100.0}) {
    lengths.push_back(length_deg * kDegree * std::sqrt(dims / 63.0));
  }
  return lengths;
}

Result<gp::Trained> fit_difference(const std::vector<Pairing>& training_pairs, double length_rad,
                                   double noise) {
  const Grid grid = grid_of(training_pairs);
  // The signal variance does not change the mean, because the noise is relative to it. It is set to
  // the residual's variance, so that the process's variance is meaningful.
  const MatrixXd residual = grid.outputs.rowwise() - grid.offset.transpose();
  const double variance =
      std::max(1e-12, residual.squaredNorm() / static_cast<double>(residual.size()));
  return gp::fit(grid.inputs, grid.outputs, grid.offset,
                 {.lambda = std::log(variance),
                  .log_mu = -2.0 * std::log(length_rad),
                  .log_b = -std::numeric_limits<double>::infinity(),
                  .log_noise = std::log(noise * variance)});
}

Result<gp::Trained> fit_paper(const MatrixXd& X, const MatrixXd& Y) {
  const gp::ScgResult best =
      gp::maximise_evidence(X, Y, paper_start(Y), kMinNoise_rad2, {.max_iterations = 300});
  return gp::fit(X, Y, VectorXd::Zero(Y.cols()), gp::Hyper::of(best.x));
}

double Way::closes() const { return 1.0 - std::sqrt(after / before); }
double Way::constant_closes() const { return 1.0 - std::sqrt(constant / before); }

void Way::add(const Way& other) {
  before += other.before;
  after += other.after;
  constant += other.constant;
}

Way way_of(const MatrixXd& q, const VectorXd& phase, const MatrixXd& goal, const MatrixXd& change,
           const Eigen::RowVectorXd& constant) {
  const MatrixXd grid = harmonic_basis(cycle_phases(kGridFrames), kCycleHarmonics);
  const auto squares = [&](const MatrixXd& frames) {
    return (grid * (fit_harmonics(phase, frames, kCycleHarmonics) - goal)).squaredNorm();
  };
  return {squares(q), squares(q + change), squares(q.rowwise() + constant)};
}

FoldError fold_error(const Fold& fold, double length_rad, double noise) {
  const auto process = fit_difference(fold.train, length_rad, noise);
  const double truth = fold.truth.squaredNorm();
  if (!process) return {std::numeric_limits<double>::infinity(), truth, {}};
  const MatrixXd change = gp::posterior_mean(*process, fold.q);
  FoldError found{(change - fold.truth).squaredNorm(), truth, {}};
  if (fold.phase.size() > 0) {
    found.way = way_of(fold.q, fold.phase, fold.goal, change, fold.constant);
  }
  return found;
}

ChosenLength choose_length_rad(const std::vector<Fold>& folds,
                               const std::vector<double>& candidates_rad, double noise,
                               double fallback_rad, const FoldProgress& progress) {
  double best = std::numeric_limits<double>::infinity();
  ChosenLength chosen{fallback_rad, {}};
  const auto total = static_cast<double>(folds.size() * candidates_rad.size());
  double done = 0.0;
  for (const double length_rad : candidates_rad) {
    double error = 0.0;
    Way way;
    for (const Fold& fold : folds) {
      // Each fold has equal weight, whatever its clip's length.
      const FoldError found = fold_error(fold, length_rad, noise);
      error += found.error / static_cast<double>(fold.q.rows());
      way.add(found.way);
      if (progress && !progress(++done / total)) return chosen;
    }
    if (!folds.empty() && error < best) {
      best = error;
      chosen = {length_rad, way};
    }
  }
  return chosen;
}

}  // namespace posed::style
