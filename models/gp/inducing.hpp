// Inducing poses: the few training poses that stand for all, chosen by greedy pivoted Cholesky, and
// the process that is learnt on them (models/gp/README.md, "Inducing poses"). Cold; thread-safe.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "models/gp/regression.hpp"
#include "proto/frame/result.hpp"

namespace posed::gp {

struct Inducing {
  std::vector<int> order;  // of all poses, the chosen ones first
  int count = 0;           // of the chosen ones, m
  Eigen::MatrixXd factor;  // F [N x m]: F F' is nearly the kernel E of all poses, e^lambda = 1

  [[nodiscard]] std::vector<int> chosen() const { return {order.begin(), order.begin() + count}; }
  // R, lower [m x m]: the chosen poses' rows of F, so that R R' is their kernel.
  [[nodiscard]] Eigen::MatrixXd root() const;
};

// Each step adds the pose that the chosen ones explain least, until there are `limit`, `enough` is
// true of the largest unexplained variance (of 1), or none is left.
[[nodiscard]] Inducing choose_inducing(const Eigen::MatrixXd& X, double mu, int limit,
                                       const std::function<bool(double)>& enough);

// Fits as fit() (regression.hpp) does with b = 0, but with at most `limit` poses, fitted to all
// pairs by least squares with the noise as ridge (subset of regressors).
Result<Trained> fit_inducing(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                             const Eigen::VectorXd& offset, const Hyper& hyper, int limit);

// The training data of one of several functions that share their poses.
struct FunctionData {
  std::vector<int> rows;   // of X
  Eigen::MatrixXd Y;       // outputs at these rows
  Eigen::VectorXd offset;  // prior mean
};

// Fits several functions as fit_inducing() does, on common poses that are chosen among all of X.
Result<std::vector<Trained>> fit_functions(const Eigen::MatrixXd& X,
                                           std::span<const FunctionData> functions,
                                           const Hyper& hyper, int limit);

}  // namespace posed::gp
