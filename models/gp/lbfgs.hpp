// Limited-memory BFGS (Nocedal and Wright 2006, algorithms 7.4, 7.5, 3.5, 3.6; models/gp/README.md,
// "Limited-memory BFGS"): minimises a smooth function of a few hundred variables. The caller scales
// the variables so that each is of order one. Cold.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace posed::gp {

// Returns f(x) and fills its gradient. A value that is not finite makes the optimiser reject the
// trial step.
using Objective = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

struct LbfgsOptions {
  int max_iterations = 100;
  int memory = 30;
  double relative_change = 1e-10;  // stop when a step lowers f by less than this times max(1, |f|)
  double max_gradient = 1e-3;      // or when no gradient component is larger than this
  std::function<bool()> stop{};    // asked in every iteration; true: the best so far will do
};

struct LbfgsResult {
  Eigen::VectorXd x;
  double value = 0.0;
  int iterations = 0;
  int evaluations = 0;
};

// Returns the lowest point found from `x0` on.
[[nodiscard]] LbfgsResult lbfgs_minimise(const Objective& objective, Eigen::VectorXd x0,
                                         const LbfgsOptions& options);

}  // namespace posed::gp
