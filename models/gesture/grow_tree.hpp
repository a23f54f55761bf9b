// Growing a decision tree over the contexts of gestures: which contexts share one Gaussian
// (models/gesture/README.md, "Decision trees"). Greedy: the question that gains most likelihood
// splits, while its gain pays for the parameters that it adds (MDL) and both halves have seen
// enough. Cold.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "models/gesture/gesture_model.hpp"

namespace posed::gesture {

// What training saw of every context: one row each.
struct ContextSums {
  Eigen::VectorXd occupancy;      // frames (durations: gestures)
  Eigen::VectorXd examples;       // gestures
  Eigen::MatrixXd first, second;  // [context][dimension] sums of o and of o^2
};

// answers[question][context]
using Answers = std::vector<std::vector<bool>>;

struct GrowOptions {
  double mdl_factor = 1.0;  // of the description length's price of a split
  double min_occupancy = 20.0;
  double min_examples = 2.0;
  std::vector<int> counted;  // the dimensions that move: likelihood and price count only these
};

struct GrownTree {
  std::vector<TreeNode> nodes;            // parents before children; leaves numbered as they stand
  std::vector<double> gain;               // [node] likelihood that its question gained; 0 at a leaf
  Eigen::MatrixXd mean, variance;         // [leaf][dimension]
  Eigen::VectorXd occupancy;              // [leaf]
  std::vector<std::vector<int>> members;  // [leaf] rows of the contexts in it
  double threshold = 0.0;                 // what a split had to gain
};

// Ties go to the first question. Variances are at least `floor` [dimension].
[[nodiscard]] GrownTree grow_tree(const ContextSums& sums, const Answers& answers,
                                  const Eigen::VectorXd& floor, const GrowOptions& options);

}  // namespace posed::gesture
