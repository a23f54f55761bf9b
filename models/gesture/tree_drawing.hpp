// The decision trees for people: as text, as Graphviz source and as an SVG picture (figure 3 of
// Takamido et al.; models/gesture/README.md, "References"). Each node shows its question and the
// contexts that reach it, written as there: {g,1}-c-* is c after g or 1, before any label. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

struct TreeChoice {
  int state = -1, group = -1;  // from 0; -1: all of them
};
// Parses "all", "middle" (all its states), "4" (state 4 of all groups) or "middle:4"; anything else
// is a usage error. A body's groups have other names than fingers.
Result<TreeChoice> tree_choice(std::string_view text,
                               const std::vector<ChannelGroup>& groups = finger_groups());

// A tree with the texts that all its drawings share, those below and those of a report.
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

// The trees in the order of groups, then of states.
[[nodiscard]] std::vector<DrawnTree> draw_trees(const GestureModel& model,
                                                const TreeChoice& choice);

[[nodiscard]] std::string trees_text(const GestureModel& model, const TreeChoice& choice);
[[nodiscard]] std::string trees_dot(const GestureModel& model, const TreeChoice& choice);

}  // namespace posed::gesture
