#include "models/gp/inducing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Cholesky>

namespace posed::gp {
namespace {

// A pose whose unexplained variance is below this adds nothing in single precision.
constexpr double kResidualMin = 1e-6;
// Unexplained variance over noise below which more poses do not change a prediction visibly.
constexpr double kOfNoise = 0.01;

}  // namespace

Eigen::MatrixXd Inducing::root() const {
  return factor(chosen(), Eigen::all).triangularView<Eigen::Lower>();
}

Inducing choose_inducing(const Eigen::MatrixXd& X, double mu, int limit,
                         const std::function<bool(double)>& enough) {
  const auto points = static_cast<int>(X.rows());
  Inducing chosen;
  chosen.order.resize(points);
  std::iota(chosen.order.begin(), chosen.order.end(), 0);
  Eigen::VectorXd residual = Eigen::VectorXd::Ones(points);
  chosen.factor.resize(points, std::min(limit, points));
  int& m = chosen.count;
  for (; m < chosen.factor.cols(); ++m) {
    Eigen::Index pivot = 0;
    const double worst = residual.maxCoeff(&pivot);
    if (worst < kResidualMin || enough(worst)) break;
    Eigen::VectorXd column = rbf(X, X.row(pivot), 0.0, mu);
    column -= chosen.factor.leftCols(m) * chosen.factor.row(pivot).head(m).transpose();
    chosen.factor.col(m) = column / std::sqrt(worst);
    residual -= chosen.factor.col(m).cwiseAbs2();
    residual[pivot] = 0.0;
    std::iter_swap(chosen.order.begin() + m,
                   std::ranges::find(chosen.order, static_cast<int>(pivot)));
  }
  chosen.factor.conservativeResize(Eigen::NoChange, m);
  return chosen;
}

Result<std::vector<Trained>> fit_functions(const Eigen::MatrixXd& X,
                                           std::span<const FunctionData> functions,
                                           const Hyper& hyper, int limit) {
  Trained trained;
  trained.lambda = hyper.lambda;
  trained.mu = std::exp(hyper.log_mu);
  trained.b = 0.0;
  trained.noise = std::exp(hyper.log_noise);
  const auto is_finite = [](const FunctionData& f) { return f.Y.allFinite(); };
  if (!X.allFinite() || !std::ranges::all_of(functions, is_finite)) {
    return fail("a training value is not finite: look for broken frames in the clips");
  }
  const double noise = trained.noise / std::exp(trained.lambda);
  const Inducing chosen =
      choose_inducing(X, trained.mu, limit, [&](double worst) { return worst < kOfNoise * noise; });
  trained.inputs = X(chosen.chosen(), Eigen::all);
  const Eigen::MatrixXd root = chosen.root();
  std::vector<Trained> learnt;
  for (const FunctionData& function : functions) {
    const Eigen::MatrixXd factor = chosen.factor(function.rows, Eigen::all);
    Eigen::MatrixXd gram = factor.transpose() * factor;
    gram.diagonal().array() += noise;
    const Eigen::MatrixXd moments =
        factor.transpose() * (function.Y.rowwise() - function.offset.transpose());
    trained.offset = function.offset;
    trained.weights =
        root.transpose().triangularView<Eigen::Upper>().solve(gram.llt().solve(moments)) /
        std::exp(trained.lambda);
    if (!trained.weights.allFinite()) {
      return fail("the covariance of the training poses is singular: raise the noise");
    }
    learnt.push_back(trained);
  }
  return learnt;
}

Result<Trained> fit_inducing(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                             const Eigen::VectorXd& offset, const Hyper& hyper, int limit) {
  std::vector<int> all(static_cast<std::size_t>(X.rows()));
  std::iota(all.begin(), all.end(), 0);
  auto learnt =
      TRY(fit_functions(X, std::array{FunctionData{std::move(all), Y, offset}}, hyper, limit));
  return std::move(learnt.front());
}

}  // namespace posed::gp
