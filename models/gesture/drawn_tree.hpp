// A tree with the texts that all its drawings share: those of tree_drawing.hpp and those of a
// report. Cold.
#pragma once

#include <string>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/tree_drawing.hpp"

namespace posed::gesture {

struct DrawnNode {
  std::string words;      // the question, or the leaf's number and frames
  std::string reach;      // the contexts that reach this node: {g,1}-c-*
  int yes = -1, no = -1;  // -1: a leaf
  int depth = 0;
};

struct DrawnTree {
  std::string title;
  std::vector<DrawnNode> nodes;  // as in the model: node 0 is the root
};

// Ordered by group, then by state.
[[nodiscard]] std::vector<DrawnTree> draw_trees(const GestureModel& model,
                                                const TreeChoice& choice);

}  // namespace posed::gesture
