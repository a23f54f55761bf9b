// The cost of trajectories beside SPTK and LAPACK in the same run; for `posed_bench generate`.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "models/trajectory/state_information.hpp"

namespace posed::bench {

// A long label sequence frame by frame on 66 channels: for each delay, cost and error against the
// full solve, beside SPTK's mlpg at the same delay. Programs that are not installed are listed
// under "missing".
[[nodiscard]] nlohmann::json bench_streaming(const trajectory::StateInformation& information);

// 366 frames of 45 channels at once, beside LAPACK's dpbsv and SPTK.
[[nodiscard]] nlohmann::json bench_batch(const trajectory::StateInformation& information,
                                         int samples);

}  // namespace posed::bench
