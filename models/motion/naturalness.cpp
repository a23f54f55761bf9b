#include "models/motion/naturalness.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include "models/motion/symmetric_eigen.hpp"

namespace posed::motion {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kMaxFrequency_hz = 10.0;  // upper end of the part of the spectrum that counts
constexpr double kMinAmplitude = 0.05;     // relative to the largest amplitude
constexpr int kPadLevel = 4;               // zero-padding: 2^4 times the next power of two
constexpr Eigen::Index kWindow = 30;       // frames of a feature
constexpr Eigen::Index kWindowsPerDimension = 10;

// Amplitude of the spectrum at each of the first `count` bins of `bins`.
std::vector<double> amplitudes(std::span<const double> signal, std::size_t bins,
                               std::size_t count) {
  std::vector<double> out(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::complex<double> turn = std::polar(
        1.0, -2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(bins));
    std::complex<double> phase = 1.0;
    std::complex<double> sum = 0.0;
    for (const double value : signal) {
      sum += value * phase;
      phase *= turn;
    }
    out[k] = std::abs(sum);
  }
  return out;
}

// For a window at every second frame: each channel's mean and the mean absolute change per frame.
Rows windows_of(const Rows& rows) {
  const Eigen::Index count = rows.rows() > kWindow ? (rows.rows() - 1 - kWindow) / 2 + 1 : 0;
  Rows features(count, 2 * rows.cols());
  for (Eigen::Index w = 0; w < count; ++w) {
    const Eigen::Index begin = 2 * w;
    features.row(w).head(rows.cols()) = rows.middleRows(begin, kWindow).colwise().mean();
    features.row(w).tail(rows.cols()) =
        (rows.middleRows(begin + 1, kWindow) - rows.middleRows(begin, kWindow))
            .cwiseAbs()
            .colwise()
            .mean();
  }
  return features;
}

// Over count - 1.
Gaussian gaussian_of(const WindowSums& sums) {
  Gaussian out;
  out.mean = sums.first / sums.count;
  out.covariance =
      (sums.second - sums.count * out.mean * out.mean.transpose()) / (sums.count - 1.0);
  return out;
}

Eigen::MatrixXd square_root(const Eigen::MatrixXd& symmetric) {
  const SymmetricEigen eigen = symmetric_eigen(symmetric);
  const Eigen::VectorXd roots = eigen.values.cwiseMax(0.0).cwiseSqrt();
  return eigen.vectors * roots.asDiagonal() * eigen.vectors.transpose();
}

}  // namespace

double jerk_rms(const Rows& rows) {
  const Eigen::Index n = rows.rows() - 3;
  if (n < 1 || rows.cols() < 1) return 0.0;
  const Rows third = rows.bottomRows(n) - 3.0 * rows.middleRows(2, n) +
                     3.0 * rows.middleRows(1, n) - rows.topRows(n);
  return std::sqrt(third.squaredNorm() / static_cast<double>(third.size()));
}

Eigen::VectorXd speed_of(const Rows& rows, double rate_hz) {
  const Eigen::Index n = std::max<Eigen::Index>(rows.rows() - 1, 0);
  return (rows.bottomRows(n) - rows.topRows(n)).rowwise().norm() * rate_hz;
}

double log_dimensionless_jerk(std::span<const double> speed, double rate_hz) {
  double peak = 0.0;
  for (const double v : speed) peak = std::max(peak, std::abs(v));
  if (speed.size() < 3 || !(peak > 0.0)) return kNone;
  const double dt_s = 1.0 / rate_hz;
  double sum = 0.0;
  for (std::size_t i = 1; i + 1 < speed.size(); ++i) {
    sum += std::pow((speed[i + 1] - 2.0 * speed[i] + speed[i - 1]) / (dt_s * dt_s), 2);
  }
  const double length_s = static_cast<double>(speed.size()) * dt_s;
  return -std::log(std::pow(length_s, 3) / (peak * peak) * sum * dt_s);
}

double spectral_arc_length(std::span<const double> speed, double rate_hz) {
  if (speed.size() < 2) return kNone;
  const auto octaves = static_cast<int>(std::ceil(std::log2(static_cast<double>(speed.size()))));
  const std::size_t bins = std::size_t{1} << static_cast<unsigned>(octaves + kPadLevel);
  const double bin_hz = rate_hz / static_cast<double>(bins);
  // Above half the rate the spectrum is the mirror image of what is below.
  const double most_hz = std::min(kMaxFrequency_hz, rate_hz / 2);
  const auto count = std::min(bins, static_cast<std::size_t>(most_hz / bin_hz) + 1);
  std::vector<double> amplitude = amplitudes(speed, bins, count);
  const double largest = *std::ranges::max_element(amplitude);
  if (!(largest > 0.0)) return kNone;
  for (double& a : amplitude) a /= largest;
  const auto counts = [](double a) { return a >= kMinAmplitude; };
  const auto first = std::ranges::find_if(amplitude, counts) - amplitude.begin();
  const auto last =
      amplitude.rend() - std::find_if(amplitude.rbegin(), amplitude.rend(), counts) - 1;
  double length = 0.0;
  for (auto k = first; k < last; ++k) {
    const double across = 1.0 / static_cast<double>(last - first);
    length += std::hypot(across, amplitude[static_cast<std::size_t>(k) + 1] - amplitude[k]);
  }
  return -length;
}

double frechet_distance(const Gaussian& a, const Gaussian& b) {
  // tr((S1 S2)^(1/2)) = tr((R S2 R)^(1/2)) with R = S1^(1/2), which is symmetric.
  const Eigen::MatrixXd root = square_root(a.covariance);
  const double cross = square_root(root * b.covariance * root).trace();
  const double spread = a.covariance.trace() + b.covariance.trace() - 2.0 * cross;
  return std::max(0.0, (a.mean - b.mean).squaredNorm() + spread);
}

void WindowSums::add(const WindowSums& other) {
  if (first.size() == 0) {
    *this = other;
    return;
  }
  count += other.count;
  first += other.first;
  second += other.second;
}

void WindowSums::subtract(const WindowSums& other) {
  count -= other.count;
  first -= other.first;
  second -= other.second;
}

WindowSums window_sums(const Rows& rows) {
  const Rows windows = windows_of(rows);
  return {static_cast<double>(windows.rows()), windows.colwise().sum().transpose(),
          windows.transpose() * windows};
}

int most_dimensions(double windows) {
  return static_cast<int>(windows) / static_cast<int>(kWindowsPerDimension);
}

double window_distance(const WindowSums& a, const WindowSums& b, int dimensions) {
  WindowSums both = a;
  both.add(b);
  const Eigen::MatrixXd axes =
      symmetric_eigen(gaussian_of(both).covariance).vectors.rightCols(dimensions);
  const auto projected = [&](const WindowSums& sums) {
    const Gaussian all = gaussian_of(sums);
    return Gaussian{axes.transpose() * all.mean, axes.transpose() * all.covariance * axes};
  };
  return frechet_distance(projected(a), projected(b));
}

Result<double> motion_distance(const Rows& a, const Rows& b, int dimensions) {
  if (a.cols() != b.cols()) return fail("the motions have different channels");
  const Eigen::RowVectorXd middle = a.colwise().mean();  // near the data: sums of squares cancel
  const WindowSums one = window_sums(a.rowwise() - middle);
  const WindowSums other = window_sums(b.rowwise() - middle);
  const int kept = std::min({dimensions, most_dimensions(std::min(one.count, other.count)),
                             static_cast<int>(one.first.size())});
  if (kept < 1) {
    return fail("the motions are too short for a distance of their features: at least " +
                std::to_string(kWindow + 2 * kWindowsPerDimension) + " frames are needed");
  }
  return window_distance(one, other, kept);
}

}  // namespace posed::motion
