#include "models/gesture/tree_drawing.hpp"

#include <algorithm>

#include "models/gesture/drawn_tree.hpp"

namespace posed::gesture {
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
