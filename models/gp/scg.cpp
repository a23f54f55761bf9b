#include "models/gp/scg.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace posed::gp {
namespace {

constexpr double kScaleMin = 1e-15;
constexpr double kScaleMax = 1e100;
constexpr double kProbe = 1e-4;  // sigma_0: how far along the direction the curvature is probed

// The state of one run; comments give the letters of Moller's paper.
struct Search {
  Eigen::VectorXd x, gradient, direction;
  double value = 0.0;
  double scale = 1.0;
  double slope = 0.0;      // mu: directional derivative
  double kappa = 0.0;      // squared length of the direction
  double curvature = 0.0;  // theta
  int successes = 0;
  bool accepted = true;
};

using Value = std::function<double(const Eigen::VectorXd&)>;
using Gradient = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

// Second-order information along the direction; false where the direction's length is zero.
bool probe(Search& s, const Gradient& gradient) {
  s.slope = s.direction.dot(s.gradient);
  if (s.slope >= 0.0) {
    s.direction = -s.gradient;
    s.slope = s.direction.dot(s.gradient);
  }
  s.kappa = s.direction.squaredNorm();
  if (!(s.kappa >= std::numeric_limits<double>::epsilon())) return false;
  const double sigma = kProbe / std::sqrt(s.kappa);
  const Eigen::VectorXd ahead = gradient(s.x + sigma * s.direction);
  const double theta = s.direction.dot(ahead - s.gradient) / sigma;
  s.curvature =
      std::isfinite(theta) ? theta : 0.0;  // no quadratic model there: the scale alone decides
  return true;
}

void turn(Search& s, const Eigen::VectorXd& old_gradient) {
  if (s.successes == s.x.size()) {
    s.direction = -s.gradient;
    s.successes = 0;
  } else if (s.accepted) {
    const double gamma = (old_gradient - s.gradient).dot(s.gradient) / s.slope;
    s.direction = gamma * s.direction - s.gradient;
  }
}

}  // namespace

ScgResult scg_minimise(const Value& value, const Gradient& gradient, const Eigen::VectorXd& start,
                       const ScgOptions& options) {
  Search s;
  s.x = start;
  s.value = value(start);
  s.gradient = gradient(start);
  s.direction = -s.gradient;
  ScgResult result;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    if (options.stop && options.stop()) break;
    if (s.accepted && !probe(s, gradient)) {
      result.converged = s.gradient.allFinite();
      break;
    }
    double delta = s.curvature + s.scale * s.kappa;
    if (delta <= 0.0) {  // make the quadratic model convex
      delta = s.scale * s.kappa;
      s.scale -= s.curvature / s.kappa;
    }
    const double step = -s.slope / delta;
    const Eigen::VectorXd trial = s.x + step * s.direction;
    const double trial_value = value(trial);
    const double change = trial_value - s.value;
    // A value that is not finite counts as a refused step; NaN would never raise the scale.
    const double comparison = std::isfinite(trial_value) ? 2.0 * change / (step * s.slope) : -1.0;
    s.accepted = comparison >= 0.0;
    const Eigen::VectorXd old_gradient = s.gradient;
    if (s.accepted) {
      s.x = trial;
      s.value = trial_value;
      ++s.successes;
    }
    result.trace.push_back({s.value, s.scale, comparison, s.x});
    if (s.accepted) {
      const bool still = (step * s.direction).lpNorm<Eigen::Infinity>() < options.tolerance_x;
      if (still && std::abs(change) < options.tolerance_f) {
        result.converged = true;
        break;
      }
      s.gradient = gradient(s.x);
      if (s.gradient.squaredNorm() == 0.0) {
        result.converged = true;
        break;
      }
    }
    if (comparison < 0.25) s.scale = std::min(4.0 * s.scale, kScaleMax);
    if (comparison > 0.75) s.scale = std::max(0.5 * s.scale, kScaleMin);
    turn(s, old_gradient);
  }
  result.x = s.x;
  result.value = s.value;
  return result;
}

}  // namespace posed::gp
