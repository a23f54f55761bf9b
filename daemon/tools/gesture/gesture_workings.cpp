// The figures of how a gesture model is made: durations, trees, look-ahead.
#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/tools/gesture/gesture_figures.hpp"
#include "models/gesture/tree_drawing.hpp"

namespace posed::tools {
namespace {

report::QuestionTree question_tree(const gesture::DrawnTree& tree) {
  report::QuestionTree out{tree.title, {}};
  for (const gesture::DrawnNode& node : tree.nodes) {
    out.nodes.push_back({node.words, node.reach, node.yes, node.no});
  }
  return out;
}

}  // namespace

report::Figure GestureFigures::durations() const {
  std::vector<report::LabelDurations> all;
  for (int label = 0; label < std::ssize(model_->labels); ++label) {
    const gesture::DurationGaussian& frames = gesture::duration(*model_, {label, label, label});
    report::LabelDurations durations{
        .label = name(label),
        .recorded = model_->labels[static_cast<std::size_t>(label)].trained,
        .mean_s = {},
        .deviation_s = {}};
    for (std::size_t s = 0; s < gesture::kStates; ++s) {
      durations.mean_s.push_back(frames.mean[s] / model_->rate_hz);
      durations.deviation_s.push_back(std::sqrt(frames.variance[s]) / model_->rate_hz);
    }
    all.push_back(std::move(durations));
  }
  return report::state_durations(all);
}

std::vector<report::Figure> GestureFigures::trees() const {
  constexpr int kMiddle = 2, kFourth = 3;  // the tree that the paper shows
  const bool hand = model_->is_hand();
  const auto& of_state = model_->trees[kFourth];
  const auto leaves = [](const auto& tree) { return tree.leaves.size(); };
  const auto largest = std::ranges::max_element(of_state, {}, leaves) - of_state.begin();
  const int first = hand ? kMiddle : static_cast<int>(largest);
  const auto words = [&](int group) {
    const std::string& of_group = model_->groups[static_cast<std::size_t>(group)].name;
    return hand ? "the " + of_group + " finger" : of_group;
  };
  const auto drawn = [&](const gesture::TreeChoice& choice) {
    std::vector<report::QuestionTree> trees;
    for (const auto& tree : gesture::draw_trees(*model_, choice)) {
      trees.push_back(question_tree(tree));
    }
    return trees;
  };
  std::vector<report::Figure> figures{
      report::decision_trees("The decision tree of " + words(first) + " in state 4",
                             drawn({.state = kFourth, .group = first}), false)};
  for (int g = 0; g < std::ssize(model_->groups); ++g) {
    figures.push_back(
        report::decision_trees("All trees of " + words(g), drawn({.state = -1, .group = g}), true));
  }
  return figures;
}

report::Figure GestureFigures::lag(std::span<const LagPoint> curve) const {
  std::vector<report::LagError> errors;
  for (const LagPoint& point : curve) {
    errors.push_back({point.frames, point.rms_deg, point.max_deg, point.jerk_ratio});
  }
  return report::lag_error(errors, model_->rate_hz);
}

}  // namespace posed::tools
