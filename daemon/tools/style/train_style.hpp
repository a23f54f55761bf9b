// Training a style model with a progress bar; shared by `train style` and the demo.
#pragma once

#include <cstdint>
#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "daemon/tools/command/ranks.hpp"
#include "daemon/tools/style/experiment.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct StyleFiles {
  std::filesystem::path model;
  bool force = false;              // also a model that is unusable
  std::filesystem::path report{};  // an HTML page, of an unusable model, too; empty: none
};

// Reads the experiment's clips, trains, writes the model and returns the report that `train --json`
// prints; see `written` and `verdict` in it. Draws progress on stderr; Ctrl-C ends it with an error
// and without a file. `ranks` share the work; one of them writes.
[[nodiscard]] Result<nlohmann::json> train_and_save(const Experiment& experiment,
                                                    std::uint64_t seed, const StyleFiles& files,
                                                    Ranks& ranks);

}  // namespace posed::tools
