// Grows a decision tree over the contexts of gestures, which determines the contexts that share one
// Gaussian (models/gesture/README.md, "Decision trees"). Greedy: a node is split by the question
// that gains most likelihood, as long as the gain exceeds the description length of the added
// parameters (MDL) and both halves have enough data. Cold.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "models/gesture/gesture_model.hpp"

namespace posed::gesture {

// Statistics of the contexts, a row for each context.
struct ContextSums {
  Eigen::VectorXd occupancy;      // frames (durations: gestures)
  Eigen::VectorXd examples;       // gestures
  Eigen::MatrixXd first, second;  // [context][dimension] sums of o and of o^2
};

// answers[question][context]
using Answers = std::vector<std::vector<bool>>;

struct GrowOptions {
  double mdl_factor = 1.0;  // factor on the description length of a split
  double min_occupancy = 20.0;
  double min_examples = 2.0;
  std::vector<int>
      counted;  // the dimensions that move; likelihood and MDL threshold use only these
};

struct GrownTree {
  std::vector<TreeNode> nodes;     // parents before children; leaves numbered in this order
  std::vector<double> gain;        // [node] log likelihood gained by its question; 0 at a leaf
  Eigen::MatrixXd mean, variance;  // [leaf][dimension]
  Eigen::VectorXd occupancy;       // [leaf]
  std::vector<std::vector<int>> members;  // [leaf] rows of the contexts in it
  double threshold = 0.0;                 // least gain of a split
};

// Ties go to the first question. Variances are at least `floor` [dimension].
[[nodiscard]] GrownTree grow_tree(const ContextSums& sums, const Answers& answers,
                                  const Eigen::VectorXd& floor, const GrowOptions& options);

}  // namespace posed::gesture
