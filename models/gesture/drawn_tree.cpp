#include "models/gesture/drawn_tree.hpp"

#include <array>
#include <cmath>

namespace posed::gesture {
namespace {

constexpr std::array<const char*, 3> kPositions{"previous", "current", "next"};

// The classes that a label at each position can have at a node.
using Allowed = std::array<std::array<bool, kClasses>, 3>;

class Words {
 public:
  Words(const GestureModel& model, int finger) : model_(model), finger_(finger) {}

  [[nodiscard]] std::string reach(const Allowed& allowed) const {
    return set(allowed[0]) + "-" + set(allowed[1]) + "-" + set(allowed[2]);
  }

  [[nodiscard]] std::string question(int number) const {
    std::array<bool, kClasses> only{};
    only[number % kClasses] = true;
    return std::string(kPositions[number / kClasses]) + " is " + set(only) + "?";
  }

 private:
  // The labels of these classes: c, {g,1}, or * for all of them.
  [[nodiscard]] std::string set(const std::array<bool, kClasses>& classes) const {
    std::string names;
    std::size_t count = 0;
    for (const Label& label : model_.labels) {
      if (!classes[label.finger_class[finger_]]) continue;
      names += (count++ == 0 ? "" : ",") + label.name;
    }
    if (count == model_.labels.size()) return "*";
    return count == 1 ? names : "{" + names + "}";
  }

  const GestureModel& model_;
  int finger_;
};

DrawnTree draw_tree(const GestureModel& model, int state, int finger) {
  const Tree<FingerGaussian>& tree = model.trees[state][finger];
  const Words words(model, finger);
  DrawnTree drawn{"state " + std::to_string(state + 1) + ", " + std::string(kFingerNames[finger]) +
                      ": " + std::to_string(tree.leaves.size()) +
                      (tree.leaves.size() == 1 ? " leaf" : " leaves"),
                  std::vector<DrawnNode>(tree.nodes.size())};
  std::vector<Allowed> allowed(tree.nodes.size());
  allowed[0].fill({true, true, true});
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
    const int position = node.question / kClasses;
    const int asked = node.question % kClasses;
    for (const int child : {node.yes, node.no}) {
      drawn.nodes[child].depth = out.depth + 1;
      allowed[child] = allowed[i];
      for (int k = 0; k < kClasses; ++k) {
        if ((k == asked) != (child == node.yes)) allowed[child][position][k] = false;
      }
    }
  }
  return drawn;
}

}  // namespace

std::vector<DrawnTree> draw_trees(const GestureModel& model, const TreeChoice& choice) {
  std::vector<DrawnTree> trees;
  for (int finger = 0; finger < kFingers; ++finger) {
    for (int state = 0; state < kStates; ++state) {
      if (choice.state >= 0 && choice.state != state) continue;
      if (choice.finger >= 0 && choice.finger != finger) continue;
      trees.push_back(draw_tree(model, state, finger));
    }
  }
  return trees;
}

}  // namespace posed::gesture
