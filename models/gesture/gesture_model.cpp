#include "models/gesture/gesture_model.hpp"

#include <algorithm>

namespace posed::gesture {
namespace {

int label_at(const Context& context, int position) noexcept {
  return position == 0 ? context.previous : position == 1 ? context.current : context.next;
}

// Descends a tree from its root to a leaf; `class_of(label)` decides its questions.
template <typename Gaussian, typename ClassOf>
int walk(const Tree<Gaussian>& tree, const Context& context, const ClassOf& class_of) noexcept {
  int node = 0;
  while (tree.nodes[node].question >= 0) {
    const TreeNode& asked = tree.nodes[node];
    const bool yes =
        class_of(label_at(context, asked.question / kClasses)) == asked.question % kClasses;
    node = yes ? asked.yes : asked.no;
  }
  return tree.nodes[node].leaf;
}

}  // namespace

int majority_class(const Label& label) noexcept {
  std::array<int, kClasses> votes{};
  for (const int finger_class : label.finger_class) ++votes[finger_class];
  return static_cast<int>(std::max_element(votes.begin(), votes.end()) - votes.begin());
}

int GestureModel::label_index(std::string_view name) const noexcept {
  const auto found = std::find_if(labels.begin(), labels.end(),
                                  [&](const Label& label) { return label.name == name; });
  return found == labels.end() ? -1 : static_cast<int>(found - labels.begin());
}

int leaf_index(const GestureModel& model, int state, int finger, const Context& context) noexcept {
  return walk(model.trees[state][finger], context,
              [&](int label) { return model.labels[label].finger_class[finger]; });
}

const FingerGaussian& leaf(const GestureModel& model, int state, int finger,
                           const Context& context) noexcept {
  return model.trees[state][finger].leaves[leaf_index(model, state, finger, context)];
}

const DurationGaussian& duration(const GestureModel& model, const Context& context) noexcept {
  const int index = walk(model.durations, context,
                         [&](int label) { return majority_class(model.labels[label]); });
  return model.durations.leaves[index];
}

}  // namespace posed::gesture
