#include "models/gesture/tree_drawing.hpp"

#include <algorithm>
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
    return question / model_.statements(group_);
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

namespace {

void text_of(const DrawnTree& tree, int node, const std::string& answer, std::string& out) {
  const DrawnNode& at = tree.nodes[node];
  out += std::string(2 * static_cast<std::size_t>(at.depth) + 2, ' ') + answer + at.words;
  if (at.yes < 0) {
    out += ": " + at.reach + "\n";
    return;
  }
  out += "\n";
  text_of(tree, at.yes, "yes  ", out);
  text_of(tree, at.no, "no   ", out);
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string dot_of(const DrawnTree& tree, std::size_t number) {
  const std::string prefix = "t" + std::to_string(number) + "_";
  const auto id = [&](int node) { return prefix + std::to_string(node); };
  std::string out = "  subgraph cluster_" + std::to_string(number) +
                    " {\n    label=" + quoted(tree.title) + ";\n";
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const DrawnNode& node = tree.nodes[i];
    const std::string words = quoted(node.words);
    const std::string reach = quoted(node.reach);
    out += "    " + id(static_cast<int>(i)) + " [label=" + words.substr(0, words.size() - 1) +
           "\\n" + reach.substr(1) + (node.yes < 0 ? ", style=filled" : "") + "];\n";
    if (node.yes < 0) continue;
    out += "    " + id(static_cast<int>(i)) + " -> " + id(node.yes) + " [label=yes];\n";
    out += "    " + id(static_cast<int>(i)) + " -> " + id(node.no) + " [label=no];\n";
  }
  return out + "  }\n";
}

}  // namespace

Result<TreeChoice> tree_choice(std::string_view text, const std::vector<ChannelGroup>& groups) {
  TreeChoice choice;
  if (text == "all") return choice;
  const auto colon = text.find(':');
  const std::string_view first = text.substr(0, colon);
  std::string_view state = colon == std::string_view::npos ? "" : text.substr(colon + 1);
  const auto group = std::ranges::find(groups, first, &ChannelGroup::name);
  if (group != groups.end()) {
    choice.group = static_cast<int>(group - groups.begin());
  } else if (colon == std::string_view::npos) {
    state = first;
  }
  const bool has_state = state.size() == 1 && state[0] >= '1' && state[0] < '1' + kStates;
  if (has_state) choice.state = state[0] - '1';
  const bool whole = choice.group >= 0 ? has_state || colon == std::string_view::npos
                                       : has_state && colon == std::string_view::npos;
  if (whole) return choice;
  return misuse("'" + std::string(text) +
                "' names no tree; write all, a finger (middle) or group of joints, a state (4) or "
                "both (middle:4)");
}

std::string trees_text(const GestureModel& model, const TreeChoice& choice) {
  std::string out;
  for (const DrawnTree& tree : draw_trees(model, choice)) {
    out += tree.title + "\n";
    text_of(tree, 0, "", out);
  }
  return out;
}

std::string trees_dot(const GestureModel& model, const TreeChoice& choice) {
  std::string out =
      "digraph trees {\n  node [shape=box, fontname=\"sans-serif\", fillcolor=\"#e4f0e0\"];\n";
  const auto trees = draw_trees(model, choice);
  for (std::size_t i = 0; i < trees.size(); ++i) out += dot_of(trees[i], i);
  return out + "}\n";
}

}  // namespace posed::gesture
