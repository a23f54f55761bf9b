#include "models/gesture/estimate.hpp"

#include <algorithm>
#include <utility>

namespace posed::gesture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

Durations durations_of(const Statistics& sums) {
  const VectorXd mean = sums.duration_first / sums.examples;
  return {mean,
          (sums.duration_second / sums.examples - mean.cwiseAbs2()).cwiseMax(kMinDurationVariance)};
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
