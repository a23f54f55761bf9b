#include "models/gp/confidence.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include "models/gp/inducing.hpp"
#include "models/gp/kernel.hpp"
#include "models/gp/regression.hpp"

namespace posed::gp {
namespace {

using kernel::kLanes;

// The least number of inducing poses. More are added, up to the limit, while the unexplained
// variance of some training pose exceeds kResidual sqrt(s). Measured on six walks, this keeps the
// confidence within 0.02 of the exact one for lengths from 75 degrees, and within 0.035 at 50
// degrees.
constexpr int kInducing = 128;
constexpr double kResidual = 0.015;

// Noise over signal variance. The lower bound keeps the matrix regular for a process without noise.
double noise_ratio(const Trained& t) { return std::max(t.noise / std::exp(t.lambda), 1e-6); }

Inducing choose(const Trained& t, int limit) {
  const double enough = kResidual * std::sqrt(noise_ratio(t));
  return choose_inducing(t.inputs, t.mu, limit, [&](int chosen, double worst) {
    return chosen >= kInducing && chosen % kLanes == 0 && worst < enough;
  });
}

// Lower L with L'L = M for M symmetric and positive: the Cholesky factor of M turned end to end.
Eigen::MatrixXd lower_root(const Eigen::MatrixXd& M) {
  const Eigen::MatrixXd turned = M.reverse();
  const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(turned).matrixL();
  return root.transpose().reverse();
}

Eigen::MatrixXd exact_triangle(const Trained& t) {
  Eigen::MatrixXd C = rbf(t.inputs, t.inputs, 0.0, t.mu);
  C.diagonal().array() += noise_ratio(t);
  const Eigen::Index n = C.rows();
  return Eigen::LLT<Eigen::MatrixXd>(C).matrixL().solve(Eigen::MatrixXd::Identity(n, n));
}

// With K_mm = R R', A = R^-1 K_mn / sqrt(s): M = R^-T (I - (I + A A')^-1) R^-1. The bracket is
// formed as (I + A A')^-1 A A', so nothing cancels.
Eigen::MatrixXd inducing_triangle(const Trained& t, const Inducing& chosen) {
  const int m = chosen.count;
  const Eigen::MatrixXd poses = t.inputs(chosen.chosen(), Eigen::all);
  Eigen::MatrixXd K_mm = rbf(poses, poses, 0.0, t.mu);
  K_mm.diagonal().array() += 1e-9;
  const Eigen::LLT<Eigen::MatrixXd> R(K_mm);
  const Eigen::MatrixXd A =
      R.matrixL().solve(rbf(poses, t.inputs, 0.0, t.mu)) / std::sqrt(noise_ratio(t));
  const Eigen::MatrixXd AA = A * A.transpose();
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(m, m);
  const Eigen::MatrixXd bracket = Eigen::LLT<Eigen::MatrixXd>(I + AA).solve(AA);
  const Eigen::MatrixXd half = R.matrixL().transpose().solve(bracket.transpose());
  const Eigen::MatrixXd M = R.matrixL().transpose().solve(half.transpose());
  return lower_root(0.5 * (M + M.transpose()) + 1e-9 * M.diagonal().maxCoeff() * I);
}

}  // namespace

Confidence confidence_of(const Trained& trained, int limit) {
  Confidence result;
  const auto points = static_cast<int>(trained.inputs.rows());
  Eigen::MatrixXd L;
  if (points <= limit) {
    result.order.resize(static_cast<std::size_t>(points));
    std::iota(result.order.begin(), result.order.end(), 0);
    L = exact_triangle(trained);
  } else {
    Inducing chosen = choose(trained, limit);
    L = inducing_triangle(trained, chosen);
    result.order = std::move(chosen.order);
  }
  const auto size = static_cast<int>(L.rows());
  result.rows = kernel::padded(size);
  result.triangle.reserve(static_cast<std::size_t>(kernel::triangle_floats(size)));
  for (int first = 0; first < result.rows; first += kLanes) {
    for (int column = 0; column < first + kLanes; ++column) {
      for (int row = first; row < first + kLanes; ++row) {
        const bool inside = row < size && column <= row;
        result.triangle.push_back(inside ? static_cast<float>(L(row, column)) : 0.0F);
      }
    }
  }
  return result;
}

}  // namespace posed::gp
