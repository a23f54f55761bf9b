// How `posed eval gesture` tells its figures to people. All take what `--json` prints. Cold.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace posed::tools {

// Whether the performance is good enough to be shown: fingers do not overlap; the held poses of a
// body are nearer to real ones than the mean pose of the training recordings is, where those are
// known.
[[nodiscard]] bool gesture_is_good(const nlohmann::json& report);

// The last line.
[[nodiscard]] std::string gesture_verdict(const nlohmann::json& report);

// The tables, on stdout.
void print_gesture_report(const nlohmann::json& report);

}  // namespace posed::tools
