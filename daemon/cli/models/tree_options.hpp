// Drawing a gesture model's trees from the command line: what `train gesture` and `eval gesture`
// share.
#pragma once

#include <memory>
#include <string>

#include "daemon/cli/output_files.hpp"
#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace CLI {
class App;
}

namespace posed::cli {

struct TreeOptions {
  std::string text, dot, svg;  // files; "-" is stdout, empty: not drawn
  std::string which = "all";
  bool which_given = false;
};

void add_tree_options(CLI::App& command, const std::shared_ptr<TreeOptions>& options);

// Whether `which` names trees, and of what is drawn somewhere; adds the drawings to `files`. To be
// asked before long work.
[[nodiscard]] Result<> check_tree_options(const TreeOptions& options, OutputFiles& files);
[[nodiscard]] Result<> draw_trees(const gesture::GestureModel& model, const TreeOptions& options);

}  // namespace posed::cli
