#include "models/gp/synthetic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "models/gp/regression.hpp"
#include "proto/frame/degree.hpp"

namespace posed::gp {
namespace {

constexpr int kHarmonics = 4;
constexpr int kFrames = 28;  // of one cycle
constexpr int kWalkers = 6;
constexpr int kQueries = 256;

// Normal numbers as sums of twelve uniform ones, because std::normal_distribution differs between
// libraries.
class Numbers {
 public:
  explicit Numbers(unsigned seed) : engine_(seed) {}
  double normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(engine_()) / 4294967296.0;
    return sum;
  }
  Eigen::MatrixXd matrix(int rows, int columns, double norm) {
    Eigen::MatrixXd m(rows, columns);
    for (auto& value : m.reshaped()) value = normal();
    return m * (norm / std::sqrt(columns));
  }

 private:
  std::mt19937 engine_;
};

// Cosine and sine rows of one gait, smaller for higher harmonics; `norm_deg` is the norm of the
// first harmonic.
Eigen::MatrixXd gait(Numbers& numbers, int dims, double norm_deg) {
  Eigen::MatrixXd rows = numbers.matrix(2 * kHarmonics, dims, norm_deg * kDegree);
  for (int h = 0; h < kHarmonics; ++h) rows.middleRows(2 * h, 2) /= (h + 1) * (h + 1);
  return rows;
}

Eigen::RowVectorXd basis(double phase) {
  Eigen::RowVectorXd b(2 * kHarmonics);
  for (int h = 0; h < kHarmonics; ++h) {
    b[2 * h] = std::cos((h + 1) * phase);
    b[2 * h + 1] = std::sin((h + 1) * phase);
  }
  return b;
}

}  // namespace

SyntheticProcess synthetic(int poses, int dims) {
  Numbers numbers(static_cast<unsigned>(poses) * 1000U + static_cast<unsigned>(dims));
  const Eigen::MatrixXd common = gait(numbers, dims, 55.0);
  const Eigen::MatrixXd change = gait(numbers, dims, 15.0);
  const Eigen::RowVectorXd carriage = numbers.matrix(1, dims, 30.0 * kDegree);
  const auto walk = [&](Eigen::MatrixXd& X, Eigen::MatrixXd* Y, int first, int count) {
    const Eigen::MatrixXd own = common + gait(numbers, dims, 15.0);
    const Eigen::RowVectorXd offset = numbers.matrix(1, dims, 30.0 * kDegree);
    for (int i = first; i < first + count; ++i) {
      const double phase = 2.0 * std::numbers::pi * (i - first) / kFrames;
      X.row(i) = offset + basis(phase) * own + numbers.matrix(1, dims, 3.0 * kDegree);
      if (Y != nullptr) Y->row(i) = carriage + basis(phase) * change;
    }
  };
  Eigen::MatrixXd X(poses, dims);
  Eigen::MatrixXd Y(poses, dims);
  const int each = std::max(kFrames, (poses + kWalkers - 1) / kWalkers);
  for (int first = 0; first < poses; first += each) {
    walk(X, &Y, first, std::min(each, poses - first));
  }
  SyntheticProcess result;
  result.queries.resize(kQueries, dims);
  walk(result.queries, nullptr, 0, kQueries);
  const double signal = 0.01;
  const Hyper hyper{std::log(signal), -2.0 * std::log(85.0 * kDegree),
                    -std::numeric_limits<double>::infinity(), std::log(0.1 * signal)};
  const Eigen::VectorXd offset = Y.colwise().mean();
  result.process = fit(X, Y, offset, hyper).value();
  return result;
}

}  // namespace posed::gp
