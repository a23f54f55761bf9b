// Scaled conjugate gradients (Moller 1993) with NETLAB's constants, the optimiser of
// Sato et al. (models/gp/README.md, "Scaled conjugate gradients"). Cold.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace posed::gp {

struct ScgOptions {
  int max_iterations = 100;
  double tolerance_x = 1e-8;     // stop when no parameter moved more than this ...
  double tolerance_f = 1e-8;     // ... and the value changed by less than this
  std::function<bool()> stop{};  // asked in every iteration; true: the best so far will do
};

struct ScgStep {
  double value;       // after the iteration: of the accepted point
  double scale;       // Moller's lambda, high where the quadratic model is not trusted
  double comparison;  // actual over predicted change; negative: the step is refused
  Eigen::VectorXd x;  // the accepted point
};

struct ScgResult {
  Eigen::VectorXd x;
  double value = 0.0;
  bool converged = false;      // by tolerance or a zero gradient; false: the iterations ran out
  std::vector<ScgStep> trace;  // one per iteration
};

// Minimises `value`, whose derivative is `gradient`, from `start`. A step to a value that is not
// finite is refused, so a function may return infinity where it is not defined; it must be finite
// at `start`.
[[nodiscard]] ScgResult scg_minimise(
    const std::function<double(const Eigen::VectorXd&)>& value,
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& gradient,
    const Eigen::VectorXd& start, const ScgOptions& options = {});

}  // namespace posed::gp
