#include "daemon/tools/gesture/tree_options.hpp"

#include <cstdio>
#include <functional>

#include <CLI/CLI.hpp>

#include "daemon/tools/gesture/gesture_report.hpp"
#include "models/gesture/tree_drawing.hpp"
#include "proto/frame/whole_file.hpp"

namespace posed::tools {
namespace {

Result<> put(const std::string& text, const std::string& file) {
  if (file == "-") {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return {};
  }
  return write_whole_file(file, text);
}

}  // namespace

void add_tree_options(CLI::App& command, const std::shared_ptr<TreeOptions>& options) {
  command.add_option("--tree-text", options->text, "Write the trees as text here; - is stdout");
  command.add_option("--tree-dot", options->dot, "Write them as Graphviz source");
  command.add_option("--tree-svg", options->svg, "Write them as a picture");
  auto* which =
      command.add_option("--trees", options->which, "Which: all, middle, 4 (a state) or middle:4");
  which->capture_default_str()->each(
      [options](const std::string&) { options->which_given = true; });
}

Result<> check_tree_options(const TreeOptions& options, OutputFiles& files,
                            const std::vector<gesture::ChannelGroup>& groups) {
  TRY(gesture::tree_choice(options.which, groups));
  if (options.which_given && options.text.empty() && options.dot.empty() && options.svg.empty()) {
    return misuse("--trees says which trees to draw; add --tree-text, --tree-dot or --tree-svg");
  }
  const auto file = [](const std::string& name) { return name == "-" ? std::string() : name; };
  files.writes_any_but_other(file(options.text), {".txt"})
      .writes_any_but_other(file(options.dot), {".dot", ".gv"})
      .writes_any_but_other(file(options.svg), {".svg"});
  return {};
}

Result<> draw_trees(const gesture::GestureModel& model, const TreeOptions& options) {
  const auto choice = TRY(gesture::tree_choice(options.which, model.groups));
  const auto svg = [&] {
    return report::svg_file(
        report::decision_trees("", gesture::draw_trees(model, choice), false).drawings);
  };
  const std::pair<const std::string&, std::function<std::string()>> drawings[]{
      {options.text, [&] { return gesture::trees_text(model, choice); }},
      {options.dot, [&] { return gesture::trees_dot(model, choice); }},
      {options.svg, svg}};
  for (const auto& [file, draw] : drawings) {
    if (file.empty()) continue;
    TRY(put(draw(), file));
  }
  return {};
}

}  // namespace posed::tools
