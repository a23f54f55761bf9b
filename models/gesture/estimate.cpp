#include "models/gesture/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNever = -std::numeric_limits<double>::infinity();

double log_add(double a, double b) {
  const double high = std::max(a, b);
  if (high == kNever) return kNever;
  return high + std::log1p(std::exp(std::min(a, b) - high));
}

// Reads a banded matrix by state; states outside the band have probability zero.
class Banded {
 public:
  Banded(const MatrixXd& values, const Band& band) : values_(values), band_(band) {}

  double operator()(Index t, int state) const {
    const int column = state - band_.first[t];
    return column >= 0 && column < band_.width ? values_(t, column) : kNever;
  }

 private:
  const MatrixXd& values_;
  const Band& band_;
};

// alpha: log probability of the frames up to t and of being in the state at t.
MatrixXd forward(const MatrixXd& density, const VectorXd& log_stay, const VectorXd& log_leave,
                 const Band& band) {
  MatrixXd alpha = MatrixXd::Constant(density.rows(), band.width, kNever);
  const Banded at(alpha, band);
  if (band.first[0] == 0) alpha(0, 0) = density(0, 0);
  for (Index t = 1; t < density.rows(); ++t) {
    for (int k = 0; k < band.width; ++k) {
      const int j = band.first[t] + k;
      const double stayed = at(t - 1, j) + log_stay[j];
      const double came = j > 0 ? at(t - 1, j - 1) + log_leave[j - 1] : kNever;
      alpha(t, k) = log_add(stayed, came) + density(t, k);
    }
  }
  return alpha;
}

// beta: log probability of the frames after t, given the state at t.
MatrixXd backward(const MatrixXd& density, const VectorXd& log_stay, const VectorXd& log_leave,
                  const Band& band) {
  const Index frames = density.rows();
  const int states = static_cast<int>(log_stay.size());
  MatrixXd beta = MatrixXd::Constant(frames, band.width, kNever);
  const Banded at(beta, band);
  const Banded emits(density, band);
  const int last = states - 1 - band.first[frames - 1];
  if (last >= 0 && last < band.width) beta(frames - 1, last) = log_leave[states - 1];
  for (Index t = frames - 2; t >= 0; --t) {
    for (int k = 0; k < band.width; ++k) {
      const int j = band.first[t] + k;
      const double stays = log_stay[j] + emits(t + 1, j) + at(t + 1, j);
      const double goes =
          j + 1 < states ? log_leave[j] + emits(t + 1, j + 1) + at(t + 1, j + 1) : kNever;
      beta(t, k) = log_add(stays, goes);
    }
  }
  return beta;
}

constexpr double kMinStay = 1e-3;
constexpr double kMinOccupancy = 1e-6;  // frames; with less, a state's mean would be noise

// Counts of a hard alignment: in each state, every frame but the last one was followed by a stay.
void add_path(Statistics& sums, const Frames& frames, const std::vector<int>& path) {
  MatrixXd gamma = MatrixXd::Zero(frames.rows(), sums.occupancy.size());
  VectorXd stays = VectorXd::Zero(sums.occupancy.size());
  for (Index t = 0; t < frames.rows(); ++t) {
    gamma(t, path[t]) = 1.0;
    if (t > 0 && path[t] == path[t - 1]) stays[path[t]] += 1.0;
  }
  sums.add(frames, gamma, stays);
}

}  // namespace

MatrixXd log_density(const Frames& frames, const StateModel& model) {
  const Index states = model.mean.rows();
  MatrixXd density(frames.rows(), states);
  for (Index j = 0; j < states; ++j) {
    const Eigen::RowVectorXd mean = model.mean.row(j);
    const Eigen::RowVectorXd precision = model.variance.row(j).cwiseInverse();
    const double norm = (2.0 * std::numbers::pi * model.variance.row(j).array()).log().sum();
    for (Index t = 0; t < frames.rows(); ++t) {
      const auto off = (frames.row(t) - mean).array();
      density(t, j) = -0.5 * (norm + (off.square() * precision.array()).sum());
    }
  }
  return density;
}

Band whole_band(Index frames, int states) { return {std::vector<int>(frames, 0), states}; }

Posterior forward_backward(const MatrixXd& density, const VectorXd& stay, const Band& band) {
  const Index frames = density.rows();
  const VectorXd log_stay = stay.array().log();
  const VectorXd log_leave = (1.0 - stay.array()).log();
  const MatrixXd alpha = forward(density, log_stay, log_leave, band);
  const MatrixXd beta = backward(density, log_stay, log_leave, band);
  const Banded before(alpha, band);
  const Banded after(beta, band);
  const Banded emits(density, band);
  const int states = static_cast<int>(stay.size());
  Posterior posterior;
  posterior.gamma = MatrixXd::Zero(frames, band.width);
  posterior.stays = VectorXd::Zero(states);
  posterior.log_likelihood = before(frames - 1, states - 1) + log_leave[states - 1];
  if (posterior.log_likelihood == kNever) return posterior;
  const double all = posterior.log_likelihood;
  posterior.gamma = (alpha + beta).unaryExpr([all](double v) { return std::exp(v - all); });
  for (Index t = 0; t + 1 < frames; ++t) {
    for (int k = 0; k < band.width; ++k) {
      const int j = band.first[t] + k;
      posterior.stays[j] +=
          std::exp(alpha(t, k) + log_stay[j] + emits(t + 1, j) + after(t + 1, j) - all);
    }
  }
  return posterior;
}

Path viterbi(const MatrixXd& density, const VectorXd& stay) {
  const Index frames = density.rows();
  const int states = static_cast<int>(stay.size());
  const VectorXd log_stay = stay.array().log();
  const VectorXd log_leave = (1.0 - stay.array()).log();
  VectorXd best = VectorXd::Constant(states, kNever);
  best[0] = density(0, 0);
  Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic> came(frames, states);
  for (Index t = 1; t < frames; ++t) {
    for (int j = states - 1; j >= 0;
         --j) {  // from the last state on, so that state j - 1 still holds the previous frame
      const double stayed = best[j] + log_stay[j];
      const double moved = j > 0 ? best[j - 1] + log_leave[j - 1] : kNever;
      came(t, j) = moved > stayed;
      best[j] = std::max(stayed, moved) + density(t, j);
    }
  }
  Path path{std::vector<int>(frames, states - 1), best[states - 1] + log_leave[states - 1]};
  for (Index t = frames - 1; t > 0; --t) {
    path.state[t - 1] = path.state[t] - (came(t, path.state[t]) ? 1 : 0);
  }
  return path;
}

Statistics::Statistics(int states, Index dims)
    : occupancy(VectorXd::Zero(states)),
      first(MatrixXd::Zero(states, dims)),
      second(MatrixXd::Zero(states, dims)),
      stays(VectorXd::Zero(states)),
      duration_first(VectorXd::Zero(states)),
      duration_second(VectorXd::Zero(states)) {}

void Statistics::add(const Frames& frames, const MatrixXd& gamma, const VectorXd& stayed) {
  const VectorXd duration = gamma.colwise().sum();
  occupancy += duration;
  first.noalias() += gamma.transpose() * frames;
  second.noalias() += gamma.transpose() * frames.cwiseAbs2();
  stays += stayed;
  duration_first += duration;
  duration_second += duration.cwiseAbs2();
  examples += 1.0;
}

StateModel estimate(const Statistics& sums, const VectorXd& floor, const StateModel& before) {
  StateModel model{sums.first, sums.second, VectorXd(sums.occupancy.size())};
  for (Index j = 0; j < sums.occupancy.size(); ++j) {
    const double frames = sums.occupancy[j];
    if (frames < kMinOccupancy) {
      model.mean.row(j) = before.mean.row(j);
      model.variance.row(j) = before.variance.row(j);
      model.stay[j] = before.stay[j];
      continue;
    }
    model.mean.row(j) /= frames;
    model.variance.row(j) =
        (sums.second.row(j) / frames - model.mean.row(j).cwiseAbs2()).cwiseMax(floor.transpose());
    model.stay[j] = std::clamp(sums.stays[j] / frames, kMinStay, 1.0 - kMinStay);
  }
  return model;
}

Statistics flat_start(const std::vector<Frames>& examples, int states) {
  Statistics sums(states, examples.front().cols());
  for (const Frames& frames : examples) {
    std::vector<int> path(static_cast<std::size_t>(frames.rows()));
    for (Index t = 0; t < frames.rows(); ++t) {
      path[t] = static_cast<int>(t * states / frames.rows());
    }
    add_path(sums, frames, path);
  }
  return sums;
}

Statistics align_hard(const std::vector<Frames>& examples, const StateModel& model) {
  Statistics sums(static_cast<int>(model.stay.size()), examples.front().cols());
  for (const Frames& frames : examples) {
    const Path path = viterbi(log_density(frames, model), model.stay);
    add_path(sums, frames, path.state);
    sums.log_likelihood += path.score;
  }
  return sums;
}

Statistics align_soft(const std::vector<Frames>& examples, const StateModel& model) {
  const auto states = static_cast<int>(model.stay.size());
  Statistics sums(states, examples.front().cols());
  for (const Frames& frames : examples) {
    const Posterior posterior =
        forward_backward(log_density(frames, model), model.stay, whole_band(frames.rows(), states));
    sums.add(frames, posterior.gamma, posterior.stays);
    sums.log_likelihood += posterior.log_likelihood;
  }
  return sums;
}

Fit baum_welch(const std::vector<Frames>& examples, StateModel start, int rounds,
               const VectorXd& floor, const std::function<bool()>& stop) {
  Fit fit;
  fit.model = std::move(start);
  for (int round = 0;; ++round) {
    fit.sums = align_soft(examples, fit.model);
    fit.log_likelihood.push_back(fit.sums.log_likelihood);
    if (round == rounds || (stop && stop())) return fit;
    fit.model = estimate(fit.sums, floor, fit.model);
  }
}

}  // namespace posed::gesture
