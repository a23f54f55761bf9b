// Left-to-right hidden Markov models without skips: one diagonal Gaussian a state, a start in the
// first state and an exit from the last (models/gesture/README.md, "Hidden Markov model"). The
// recursions run in the log domain: the linear ones overflow on real gloves. Cold.
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

using Frames = Eigen::Ref<const FeatureMatrix>;  // a stretch of a recording's features

// ln N(o_t; mean_j, variance_j): [frame][state].
[[nodiscard]] Eigen::MatrixXd log_density(const Frames& frames, const StateModel& model);

// A chain of states against a stretch of frames. Frame t may only be in the states
// [first[t], first[t] + width), `first` rising; column k of a row stands for state first[t] + k.
// A model against its own example is the chain whose band is all of it.
struct Band {
  std::vector<int> first;  // [frame]
  int width = 0;
};
[[nodiscard]] Band whole_band(Eigen::Index frames, int states);

struct Posterior {
  Eigen::MatrixXd gamma;    // [frame][band column]: probability of the state
  Eigen::VectorXd stays;    // [state] expected number of frames after which it stayed
  double log_likelihood{};  // -infinity when no path fits: gamma and stays are then zero
};

// `density` is [frame][band column], `stay` [state].
[[nodiscard]] Posterior forward_backward(const Eigen::MatrixXd& density,
                                         const Eigen::VectorXd& stay, const Band& band);

struct Path {
  std::vector<int> state;  // [frame]
  double score{};          // log probability of the path with its frames
};

// The best path of one model; frames are at least as many as states.
[[nodiscard]] Path viterbi(const Eigen::MatrixXd& density, const Eigen::VectorXd& stay);

}  // namespace posed::gesture
