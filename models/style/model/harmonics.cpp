#include "models/style/model/harmonics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTurn = 2.0 * std::numbers::pi;

// models/style/README.md, "Stride": 0.2 for a missing first harmonic, 400 frequencies.
constexpr double kFirstHarmonicPenalty = 0.2;
constexpr int kFrequencies = 400;
constexpr int kFineSteps = 20;

}  // namespace

VectorXd clip_phase(double theta0, double dtheta, int frames) {
  return (theta0 + dtheta * VectorXd::LinSpaced(frames, 0.0, frames - 1.0).array()).matrix();
}

VectorXd cycle_phases(int frames) { return clip_phase(0.0, kTurn / frames, frames); }

MatrixXd harmonic_basis(const VectorXd& theta, int harmonics) {
  MatrixXd z(theta.size(), 2 * harmonics + 1);
  z.col(0).setOnes();
  for (int n = 1; n <= harmonics; ++n) {
    z.col(n) = (n * theta.array()).cos();
    z.col(harmonics + n) = (n * theta.array()).sin();
  }
  return z;
}

MatrixXd fit_harmonics(const VectorXd& theta, const MatrixXd& y, int harmonics) {
  constexpr double kRidge = 1e-3;
  const MatrixXd z = harmonic_basis(theta, harmonics);
  // The ridge pulls towards the mean, not towards zero.
  const Eigen::RowVectorXd mean = y.colwise().mean();
  MatrixXd gram = z.transpose() * z;
  gram.diagonal().array() += kRidge;
  MatrixXd coefficients = gram.llt().solve(z.transpose() * (y.rowwise() - mean));
  coefficients.row(0) += mean;
  return coefficients;
}

MatrixXd grid_basis() { return harmonic_basis(cycle_phases(kGridFrames), kCycleHarmonics); }

double first_harmonic_phase(const VectorXd& theta, const VectorXd& signal) {
  const MatrixXd c = fit_harmonics(theta, signal, kStrideHarmonics);
  return std::atan2(c(1 + kStrideHarmonics, 0), c(1, 0));
}

double weak_first_penalty(const VectorXd& c) {
  const double first = c[1] * c[1] + c[1 + kStrideHarmonics] * c[1 + kStrideHarmonics];
  const double share = first / (c.tail(2 * kStrideHarmonics).squaredNorm() + 1e-300);
  return kFirstHarmonicPenalty * (1.0 - share);
}

bool has_stride(int frames, double rate_hz) { return frames >= kMinStride_s * rate_hz + 1.0; }

Stride find_stride(const VectorXd& signal, double rate_hz) {
  const auto frames = static_cast<int>(signal.size());
  assert(has_stride(frames, rate_hz));
  const double longest = std::min(kMaxStride_s * rate_hz, static_cast<double>(frames));
  const double slowest = kTurn / longest;
  const double fastest = kTurn / (kMinStride_s * rate_hz);
  const VectorXd centred = signal.array() - signal.mean();
  const double power = std::max(centred.squaredNorm(), 1e-300);
  Stride best;
  best.score = std::numeric_limits<double>::infinity();
  const auto try_rate = [&](double dtheta) {
    const MatrixXd z = harmonic_basis(clip_phase(0.0, dtheta, frames), kStrideHarmonics);
    const VectorXd c = z.colPivHouseholderQr().solve(centred);
    const double score = (centred - z * c).squaredNorm() / power + weak_first_penalty(c);
    if (score < best.score) {
      best = {std::atan2(-c[1 + kStrideHarmonics], c[1]), dtheta, score};
    }
  };
  const double step = (fastest - slowest) / (kFrequencies - 1.0);
  for (int i = 0; i < kFrequencies; ++i) try_rate(slowest + step * i);
  // Between the grid's points: a long clip at a slightly wrong rate ends far out of phase.
  const double coarse = best.dtheta;
  for (int i = -kFineSteps; i <= kFineSteps; ++i) try_rate(coarse + step * i / kFineSteps);
  return best;
}

}  // namespace posed::style
