#include "models/gesture/drawn_tree.hpp"

#include <array>
#include <cmath>

namespace posed::gesture {
namespace {

constexpr std::array<const char*, 3> kPositions{"previous", "current", "next"};

// The labels that can be at each position at a node.
using Allowed = std::array<std::vector<bool>, 3>;

class Words {
 public:
  Words(const GestureModel& model, int group) : model_(model), group_(group) {}

  [[nodiscard]] std::string reach(const Allowed& allowed) const {
    return set(allowed[0]) + "-" + set(allowed[1]) + "-" + set(allowed[2]);
  }

  [[nodiscard]] std::string question(int number) const {
    return std::string(kPositions[position_of(number)]) + " is " + set(yes(number)) + "?";
  }

  [[nodiscard]] std::size_t position_of(int question) const {
    return static_cast<std::size_t>(question / model_.statements(group_));
  }

  // [label] for which the question's answer is yes.
  [[nodiscard]] std::vector<bool> yes(int question) const {
    std::vector<bool> labels;
    labels.reserve(model_.labels.size());
    for (int label = 0; label < std::ssize(model_.labels); ++label) {
      labels.push_back(model_.holds(group_, question % model_.statements(group_), label));
    }
    return labels;
  }

 private:
  // These labels: c, {g,1}, or * for all of them.
  [[nodiscard]] std::string set(const std::vector<bool>& labels) const {
    std::string names;
    std::size_t count = 0;
    for (std::size_t label = 0; label < labels.size(); ++label) {
      if (!labels[label]) continue;
      names += (count++ == 0 ? "" : ",") + model_.labels[label].name;
    }
    if (count == model_.labels.size()) return "*";
    return count == 1 ? names : "{" + names + "}";
  }

  const GestureModel& model_;
  int group_;
};

DrawnTree draw_tree(const GestureModel& model, int state, int group) {
  const Tree<GroupGaussian>& tree = model.trees[state][group];
  const Words words(model, group);
  DrawnTree drawn{"state " + std::to_string(state + 1) + ", " + model.groups[group].name + ": " +
                      std::to_string(tree.leaves.size()) +
                      (tree.leaves.size() == 1 ? " leaf" : " leaves"),
                  std::vector<DrawnNode>(tree.nodes.size())};
  std::vector<Allowed> allowed(tree.nodes.size());
  allowed[0].fill(std::vector<bool>(model.labels.size(), true));
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {  // parents stand before their children
    const TreeNode& node = tree.nodes[i];
    DrawnNode& out = drawn.nodes[i];
    out.reach = words.reach(allowed[i]);
    if (node.question < 0) {
      out.words = "leaf " + std::to_string(node.leaf) + ", " +
                  std::to_string(std::lround(tree.occupancy[node.leaf])) + " frames";
      continue;
    }
    out.words = words.question(node.question);
    out.yes = node.yes;
    out.no = node.no;
    const std::vector<bool> yes = words.yes(node.question);
    for (const int child : {node.yes, node.no}) {
      drawn.nodes[child].depth = out.depth + 1;
      allowed[child] = allowed[i];
      std::vector<bool>& labels = allowed[child][words.position_of(node.question)];
      for (std::size_t label = 0; label < labels.size(); ++label) {
        if (yes[label] != (child == node.yes)) labels[label] = false;
      }
    }
  }
  return drawn;
}

}  // namespace

std::vector<DrawnTree> draw_trees(const GestureModel& model, const TreeChoice& choice) {
  std::vector<DrawnTree> trees;
  for (int group = 0; group < std::ssize(model.groups); ++group) {
    for (int state = 0; state < kStates; ++state) {
      if (choice.state >= 0 && choice.state != state) continue;
      if (choice.group >= 0 && choice.group != group) continue;
      trees.push_back(draw_tree(model, state, group));
    }
  }
  return trees;
}

}  // namespace posed::gesture
