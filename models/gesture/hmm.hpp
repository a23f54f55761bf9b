// Left-to-right hidden Markov models without skips: one diagonal Gaussian per state, start in the
// first state, exit from the last (models/gesture/README.md, "Hidden Markov model"). The recursions
// run in the log domain: the linear ones overflow on real gloves. Cold.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "models/gesture/features.hpp"

namespace posed::gesture {

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

}  // namespace posed::gesture
