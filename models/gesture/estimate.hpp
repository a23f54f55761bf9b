// Statistics of aligned frames and the models estimated from them: flat start, segmental k-means
// and Baum-Welch on isolated examples (models/gesture/README.md, "Estimation" and "Durations").
// Cold.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "models/gesture/features.hpp"

namespace posed::gesture {

inline constexpr double kMinDurationVariance = 0.25;  // of a state [frames^2]: half a frame

// Left-to-right hidden Markov models without skips: one diagonal Gaussian per state, start in the
// first state, exit from the last (models/gesture/README.md, "Hidden Markov model"). The recursions
// run in the log domain: the linear ones overflow on real gloves. Cold.

// States x dimensions, and the probability to stay in each state for one more frame.
struct StateModel {
  Eigen::MatrixXd mean, variance;
  Eigen::VectorXd stay;
};

using Frames = Eigen::Ref<const FeatureMatrix>;  // consecutive frames of a recording's features

// ln N(o_t; mean_j, variance_j): [frame][state]. Variances are positive.
[[nodiscard]] Eigen::MatrixXd log_density(const Frames& frames, const StateModel& model);

// A chain of states and the frames that it is aligned with. Frame t may only be in the states
// [first[t], first[t] + width), `first` never falling; column k of a row stands for state first[t]
// + k. When one model is aligned with one example, the band covers all states.
struct Band {
  std::vector<int> first;  // [frame]
  int width = 0;
};
[[nodiscard]] Band whole_band(Eigen::Index frames, int states);

struct Posterior {
  Eigen::MatrixXd gamma;  // [frame][band column]: probability of the state
  Eigen::VectorXd stays;  // [state] expected number of times that the state was followed by itself
  double log_likelihood{};  // -infinity when no path exists; gamma and stays are then zero
};

// `density` is [frame][band column] of at least one frame, `stay` [state]; first[t] + width is at
// most the number of states.
[[nodiscard]] Posterior forward_backward(const Eigen::MatrixXd& density,
                                         const Eigen::VectorXd& stay, const Band& band);

struct Path {
  std::vector<int> state;  // [frame]
  double score{};          // log probability of the path with its frames
};

// The best path through one model; its score is -infinity with fewer frames than states.
[[nodiscard]] Path viterbi(const Eigen::MatrixXd& density, const Eigen::VectorXd& stay);

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
