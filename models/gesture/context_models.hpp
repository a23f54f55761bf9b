// From labelled recordings to the statistics of every context (a gesture with its two neighbours):
// first a model for each label, from it a model for each context, and last, optionally, rounds over
// whole recordings in which the labels' borders may move (models/gesture/README.md, "Estimation").
// Cold.
#pragma once

#include <functional>
#include <vector>

#include "models/gesture/estimate.hpp"
#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"
#include "models/tasks.hpp"

namespace posed::gesture {

struct ContextOptions {
  int segmental_rounds, rounds, embedded_rounds;
  double embedded_slack_s;
  TaskRunner* tasks;                              // labels, contexts and recordings are its tasks
  std::function<bool(double fraction)> progress;  // returning false stops
};

struct ContextModels {
  std::vector<Context> contexts;  // in the order of their indices
  std::vector<Statistics> sums;   // [context] features [window][channel]
  Eigen::VectorXd floor;          // least variance [feature]
  std::vector<bool> moves;        // [channel] false: the channel is constant
  double log_likelihood = 0.0;    // of the last round, all contexts together
};

// Every segment's label is one of `labels`, every recording has segments; the neighbours of a
// recording's first and last gesture are that gesture itself. Errors: the progress callback asked
// to stop, or no channel moves.
Result<ContextModels> train_contexts(const std::vector<Recording>& recordings,
                                     const std::vector<Label>& labels,
                                     const ContextOptions& options);

}  // namespace posed::gesture
