#include "models/style/train/difference_process.hpp"

#include <cmath>
#include <limits>

#include "models/gp/inducing.hpp"
#include "models/style/model/harmonics.hpp"
#include "proto/frame/degree.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// 1e-3 deg^2, that is (0.03 degrees)^2: no joint angle is known more precisely. MGPM cycles contain
// no noise of their own.
constexpr double kMinNoise_rad2 = 3.05e-7;

// Cycles as harmonic coefficients to their poses, one below the other.
MatrixXd on_grid(const std::vector<MatrixXd>& cycles) {
  const MatrixXd basis = grid_basis();
  MatrixXd poses(kGridFrames * std::ssize(cycles), cycles.front().cols());
  for (Eigen::Index i = 0; i < std::ssize(cycles); ++i) {
    poses.middleRows(i * kGridFrames, kGridFrames) = basis * cycles[i];
  }
  return poses;
}

// The signal variance does not change the mean, because the noise is relative to it. It is set to
// the residual's variance, so that the process's variance is meaningful.
gp::Hyper hyper_of(const Kernel& kernel, double residual_variance) {
  const double variance = std::max(1e-12, residual_variance);
  return {.lambda = std::log(variance),
          .log_mu = -2.0 * std::log(kernel.length_rad),
          .log_b = -std::numeric_limits<double>::infinity(),
          .log_noise = std::log(kernel.noise * variance)};
}

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

}  // namespace

MatrixXd scaled(const MatrixXd& poses, const VectorXd& scale) {
  return scale.size() == 0 ? poses : MatrixXd(poses * scale.asDiagonal());
}

MatrixXd grid_inputs(const TrainingPairs& pairs) {
  return scaled(on_grid(pairs.inputs), pairs.scale);
}

namespace {

// Inputs as they are, with the scale that they were learnt at.
void unscale(const VectorXd& scale, gp::Trained& process) {
  if (scale.size() == 0) return;
  process.inputs *= scale.cwiseInverse().asDiagonal();
  process.scale = scale;
}

}  // namespace

MatrixXd grid_outputs(const Outputs& outputs) {
  const MatrixXd basis = grid_basis();
  MatrixXd Y = MatrixXd::Zero(kGridFrames * std::ssize(outputs.of_input), outputs.offset.size());
  for (Eigen::Index i = 0; i < std::ssize(outputs.of_input); ++i) {
    const int d = outputs.of_input[i];
    if (d == kNoDifference) continue;
    Y.middleRows(i * kGridFrames, kGridFrames) = basis * outputs.differences[d];
  }
  return Y;
}

Result<gp::Trained> fit_difference(const TrainingPairs& pairs, const Kernel& kernel) {
  const MatrixXd X = grid_inputs(pairs);
  const MatrixXd Y = grid_outputs(pairs.outputs);
  const VectorXd offset = pairs.outputs.offset.transpose();
  const MatrixXd residual = Y.rowwise() - offset.transpose();
  const gp::Hyper hyper =
      hyper_of(kernel, residual.squaredNorm() / static_cast<double>(residual.size()));
  auto process = TRY(X.rows() <= kMaxPoses ? gp::fit(X, Y, offset, hyper)
                                           : gp::fit_inducing(X, Y, offset, hyper, kMaxPoses));
  unscale(pairs.scale, process);
  return process;
}

Result<std::vector<gp::Trained>> fit_differences(std::span<const StylePairs> styles,
                                                 const std::vector<MatrixXd>& cycles,
                                                 const Kernel& kernel) {
  std::vector<gp::FunctionData> functions;
  double squares = 0.0;
  double count = 0.0;
  std::size_t poses = 0;
  for (const StylePairs& style : styles) {
    gp::FunctionData& function = functions.emplace_back();
    for (const int clip : style.clips) {
      for (int i = 0; i < kGridFrames; ++i) function.rows.push_back(clip * kGridFrames + i);
    }
    function.Y = grid_outputs(style.pairs.outputs);
    function.offset = style.pairs.outputs.offset.transpose();
    squares += (function.Y.rowwise() - function.offset.transpose()).squaredNorm();
    count += static_cast<double>(function.Y.size());
    poses = std::max(poses, function.rows.size());
  }
  const VectorXd& scale = styles.front().pairs.scale;
  auto processes = TRY(gp::fit_functions(scaled(on_grid(cycles), scale), functions,
                                         hyper_of(kernel, squares / count),
                                         std::min(static_cast<int>(poses), kMaxPoses)));
  for (gp::Trained& process : processes) unscale(scale, process);
  return processes;
}

gp::Hyper paper_kernel(const MatrixXd& X, const MatrixXd& Y, const std::function<bool()>& stop) {
  const gp::ScgResult best = gp::maximise_evidence(X, Y, paper_start(Y), kMinNoise_rad2,
                                                   {.max_iterations = 300, .stop = stop});
  return gp::Hyper::of(best.x);
}

Result<gp::Trained> fit_paper(const MatrixXd& X, const MatrixXd& Y, const gp::Hyper& kernel) {
  return gp::fit(X, Y, VectorXd::Zero(Y.cols()), kernel);
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
  const MatrixXd grid = grid_basis();
  const auto squares = [&](const MatrixXd& frames) {
    return (grid * (fit_harmonics(phase, frames, kCycleHarmonics) - goal)).squaredNorm();
  };
  return {squares(q), squares(q + change), squares(q.rowwise() + constant)};
}

}  // namespace posed::style
