// Options to draw the trees of a gesture model; shared by `train gesture` and `eval gesture`.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/tools/command/output_files.hpp"
#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace CLI {
class App;
}

namespace posed::tools {

struct TreeOptions {
  std::string text, dot, svg;  // files; "-" is stdout, empty: not drawn
  std::string which = "all";
  bool which_given = false;
};

void add_tree_options(CLI::App& command, const std::shared_ptr<TreeOptions>& options);

// Checks that `which` names trees of these groups, and that they are drawn somewhere if it is
// given; adds the drawings to `files`. Call before long work.
Result<> check_tree_options(const TreeOptions& options, OutputFiles& files,
                            const std::vector<gesture::ChannelGroup>& groups);
Result<> draw_trees(const gesture::GestureModel& model, const TreeOptions& options);

}  // namespace posed::tools
