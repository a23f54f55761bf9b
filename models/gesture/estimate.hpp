// Statistics of aligned frames and the models estimated from them: flat start, segmental k-means
// and Baum-Welch on isolated examples (models/gesture/README.md, "Estimation" and "Durations").
// Cold.
#pragma once

#include <functional>
#include <vector>

#include "models/gesture/hmm.hpp"

namespace posed::gesture {

inline constexpr double kMinDurationVariance = 0.25;  // of a state [frames^2]: half a frame

// Sums over examples; matrices are states x dimensions.
struct Statistics {
  Eigen::VectorXd occupancy;      // expected frames in each state
  Eigen::MatrixXd first, second;  // sums of o and o^2, weighted by gamma
  Eigen::VectorXd stays;
  Eigen::VectorXd duration_first, duration_second;  // sums of an example's d and d^2 a state
  double examples = 0.0;
  double log_likelihood = 0.0;

  Statistics() = default;
  Statistics(int states, Eigen::Index dims);
  // One example whose frames are in the states with probability gamma [frame][state].
  void add(const Frames& frames, const Eigen::MatrixXd& gamma, const Eigen::VectorXd& stays);
};

// Means, variances (floored at `floor` [dimension]) and self-transition probabilities, clamped to
// 0.001..0.999. A state without any frames keeps the values of `before`.
[[nodiscard]] StateModel estimate(const Statistics& sums, const Eigen::VectorXd& floor,
                                  const StateModel& before);

// Cuts every example into equal parts: frame t of T is in state t * states / T.
[[nodiscard]] Statistics flat_start(const std::vector<Frames>& examples, int states);
// Aligns every example along its best path through the model.
[[nodiscard]] Statistics align_hard(const std::vector<Frames>& examples, const StateModel& model);
// Aligns every example by the posterior of its states (E step of Baum-Welch).
[[nodiscard]] Statistics align_soft(const std::vector<Frames>& examples, const StateModel& model);

// How long the examples stay in each state: mean [frames] and variance [frames^2] over the
// examples; variances at least 0.25.
struct Durations {
  Eigen::VectorXd mean, variance;
};
[[nodiscard]] Durations durations_of(const Statistics& sums);

// Runs estimate and align `rounds` times, fewer where `stop` (may be empty) says so; `model` is the
// one of the last alignment.
struct Fit {
  StateModel model;
  Statistics sums;
  std::vector<double> log_likelihood;  // before each round and after the last
};
[[nodiscard]] Fit baum_welch(const std::vector<Frames>& examples, StateModel start, int rounds,
                             const Eigen::VectorXd& floor, const std::function<bool()>& stop = {});

}  // namespace posed::gesture
