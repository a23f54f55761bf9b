#include "models/gesture/gesture_model.hpp"

namespace posed::gesture {
namespace {

int label_at(const Context& context, int position) noexcept {
  return position == 0 ? context.previous : position == 1 ? context.current : context.next;
}

// Descends the tree of a group, or that of the durations, from its root to a leaf.
template <typename Gaussian>
RT_SAFE int walk(const Tree<Gaussian>& tree, const Vocabulary& vocabulary, int group,
                 const Context& context) noexcept {
  const int statements = vocabulary.statements(group);
  int node = 0;
  while (tree.nodes[node].question >= 0) {
    const TreeNode& asked = tree.nodes[node];
    const int label = label_at(context, asked.question / statements);
    node = vocabulary.holds(group, asked.question % statements, label) ? asked.yes : asked.no;
  }
  return tree.nodes[node].leaf;
}

}  // namespace

RT_SAFE int leaf_index(const GestureModel& model, int state, int group,
                       const Context& context) noexcept {
  return walk(model.trees[state][group], model, group, context);
}

RT_SAFE const GroupGaussian& leaf(const GestureModel& model, int state, int group,
                                  const Context& context) noexcept {
  return model.trees[state][group].leaves[leaf_index(model, state, group, context)];
}

RT_SAFE const DurationGaussian& duration(const GestureModel& model,
                                         const Context& context) noexcept {
  return model.durations.leaves[walk(model.durations, model, Vocabulary::kDurations, context)];
}

}  // namespace posed::gesture
