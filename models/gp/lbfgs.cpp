#include "models/gp/lbfgs.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

namespace posed::gp {
namespace {

using Eigen::VectorXd;

constexpr double kArmijo = 1e-4;    // c1 of the strong Wolfe conditions
constexpr double kCurvature = 0.9;  // c2
constexpr int kMaxTrials = 30;

struct Point {
  double step = 0.0;
  double value = 0.0;
  double slope = 0.0;  // along the search direction
  VectorXd gradient;
};

// The minimum of the cubic through two values and slopes, kept away from both ends.
double cubic_minimum(const Point& a, const Point& b) {
  const double lo = std::min(a.step, b.step);
  const double hi = std::max(a.step, b.step);
  const double middle = 0.5 * (lo + hi);
  const double d1 = a.slope + b.slope - 3.0 * (a.value - b.value) / (a.step - b.step);
  const double inside = d1 * d1 - a.slope * b.slope;
  if (!std::isfinite(inside) || inside < 0.0) return middle;
  const double d2 = std::copysign(std::sqrt(inside), b.step - a.step);
  const double step =
      b.step - (b.step - a.step) * (b.slope + d2 - d1) / (b.slope - a.slope + 2.0 * d2);
  const double margin = 0.1 * (hi - lo);
  return std::isfinite(step) ? std::clamp(step, lo + margin, hi - margin) : middle;
}

class LineSearch {
 public:
  LineSearch(const Objective& objective, const VectorXd& x, const VectorXd& direction)
      : objective_(objective), x_(x), direction_(direction) {}

  // Returns a point that meets the strong Wolfe conditions, else the lowest point found; step 0
  // when no point is lower than the start.
  Point search(const Point& start, double first_step) {
    Point previous = start;
    double step = first_step;
    for (int i = 0; i < kMaxTrials; ++i) {
      Point trial = at(step);
      if (too_high(trial, start) || (i > 0 && trial.value >= previous.value)) {
        return zoom(start, std::move(previous), std::move(trial));
      }
      if (std::abs(trial.slope) <= -kCurvature * start.slope) return trial;
      if (trial.slope >= 0.0) return zoom(start, std::move(trial), std::move(previous));
      previous = std::move(trial);
      step *= 2.0;
    }
    return previous;
  }

  [[nodiscard]] int evaluations() const { return evaluations_; }

 private:
  Point at(double step) {
    Point point;
    point.step = step;
    point.gradient.resize(x_.size());
    point.value = objective_(x_ + step * direction_, point.gradient);
    point.slope = point.gradient.dot(direction_);
    ++evaluations_;
    return point;
  }

  static bool too_high(const Point& point, const Point& start) {
    return !std::isfinite(point.value) || !std::isfinite(point.slope) ||
           point.value > start.value + kArmijo * point.step * start.slope;
  }

  // `low` is the lowest point so far; the interval between it and `high` contains an acceptable
  // point.
  Point zoom(const Point& start, Point low, Point high) {
    for (int i = 0; i < kMaxTrials; ++i) {
      if (std::abs(high.step - low.step) * low.gradient.lpNorm<Eigen::Infinity>() < 1e-16) break;
      Point trial = at(cubic_minimum(low, high));
      if (too_high(trial, start) || trial.value >= low.value) {
        high = std::move(trial);
        continue;
      }
      if (std::abs(trial.slope) <= -kCurvature * start.slope) return trial;
      if (trial.slope * (high.step - low.step) >= 0.0) high = std::move(low);
      low = std::move(trial);
    }
    return low;
  }

  const Objective& objective_;
  const VectorXd& x_;
  const VectorXd& direction_;
  int evaluations_ = 0;
};

// The last steps and gradient changes; applies the inverse Hessian that they imply to a gradient.
class History {
 public:
  explicit History(int memory) : memory_(memory) {}

  void add(VectorXd step, VectorXd change) {
    const double product = step.dot(change);
    if (product <= 1e-12 * change.squaredNorm())
      return;  // the approximation would not stay positive definite
    pairs_.push_back({std::move(step), std::move(change), 1.0 / product});
    if (static_cast<int>(pairs_.size()) > memory_) pairs_.pop_front();
  }
  void clear() { pairs_.clear(); }
  [[nodiscard]] bool empty() const { return pairs_.empty(); }

  [[nodiscard]] VectorXd direction(const VectorXd& gradient) const {
    VectorXd r = -gradient;
    VectorXd alpha(pairs_.size());
    for (auto i = static_cast<int>(pairs_.size()) - 1; i >= 0; --i) {
      const auto& p = pairs_[i];
      alpha[i] = p.inverse_product * p.step.dot(r);
      r -= alpha[i] * p.change;
    }
    if (!pairs_.empty()) {
      const auto& last = pairs_.back();
      r /= last.inverse_product * last.change.squaredNorm();
    }
    for (int i = 0; i < static_cast<int>(pairs_.size()); ++i) {
      const auto& p = pairs_[i];
      r += (alpha[i] - p.inverse_product * p.change.dot(r)) * p.step;
    }
    return r;
  }

 private:
  struct Pair {
    VectorXd step, change;
    double inverse_product;
  };
  std::deque<Pair> pairs_;
  int memory_;
};

}  // namespace

LbfgsResult lbfgs_minimise(const Objective& objective, VectorXd x0, const LbfgsOptions& options) {
  LbfgsResult result;
  result.x = std::move(x0);
  Point now;
  now.gradient.resize(result.x.size());
  now.value = objective(result.x, now.gradient);
  result.evaluations = 1;
  History history(options.memory);
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    if (now.gradient.size() == 0 ||
        now.gradient.lpNorm<Eigen::Infinity>() <= options.max_gradient) {
      break;
    }
    if (options.stop && options.stop()) break;
    VectorXd direction = history.direction(now.gradient);
    now.step = 0.0;
    now.slope = now.gradient.dot(direction);
    if (now.slope >= 0.0) {
      history.clear();
      direction = -now.gradient;
      now.slope = -now.gradient.squaredNorm();
    }
    const double first_step = history.empty() ? std::min(1.0, 1.0 / now.gradient.norm()) : 1.0;
    LineSearch line(objective, result.x, direction);
    Point next = line.search(now, first_step);
    result.evaluations += line.evaluations();
    if (next.step == 0.0 || !(next.value < now.value)) break;
    const VectorXd taken = next.step * direction;
    history.add(taken, next.gradient - now.gradient);
    result.x += taken;
    const double drop = now.value - next.value;
    now = std::move(next);
    if (drop <= options.relative_change * std::max(1.0, std::abs(now.value))) break;
  }
  result.value = now.value;
  return result;
}

}  // namespace posed::gp
