// Drawing a gesture model's trees from the command line: what `train gesture` and `eval gesture`
// share.
#pragma once

#include <memory>
#include <string>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace CLI {
class App;
}

namespace posed::cli {

struct TreeOptions {
  std::string text, dot, svg;  // files; "-" is stdout, empty: not drawn
  std::string which = "all";
};

void add_tree_options(CLI::App& command, const std::shared_ptr<TreeOptions>& options);

// Whether `which` names trees; to be asked before long work.
[[nodiscard]] Result<> check_tree_options(const TreeOptions& options);
[[nodiscard]] Result<> draw_trees(const gesture::GestureModel& model, const TreeOptions& options);

}  // namespace posed::cli
