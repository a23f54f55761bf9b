// Training a style model with a progress bar; shared by `train style` and the demo.
#pragma once

#include <cstdint>
#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "daemon/cli/models/experiment.hpp"
#include "daemon/cli/models/ranks.hpp"
#include "proto/frame/result.hpp"

namespace posed::cli {

// Reads the experiment's clips, trains, writes the model to `out` and returns the report that
// `train --json` prints. A model that is unusable is written only with `force`; see `written` and
// `verdict` in the report. Draws progress on stderr; Ctrl-C ends it with an error and without a
// file. `ranks` share the work; one of them writes.
[[nodiscard]] Result<nlohmann::json> train_and_save(const Experiment& experiment,
                                                    std::uint64_t seed,
                                                    const std::filesystem::path& out, bool force,
                                                    Ranks& ranks);

}  // namespace posed::cli
