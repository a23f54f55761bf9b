// What trajectories cost, against SPTK and LAPACK in the same run; for `posed_bench generate`.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "models/trajectory/state_information.hpp"

namespace posed::bench {

// A long script frame by frame on 66 channels: cost and error against the full solve by delay,
// beside SPTK's mlpg at the same delay. What is not installed is named under "missing".
[[nodiscard]] nlohmann::json bench_streaming(const trajectory::StateInformation& evidence);

// 366 frames of 45 channels at once, beside LAPACK's dpbsv and SPTK.
[[nodiscard]] nlohmann::json bench_batch(const trajectory::StateInformation& evidence, int samples);

}  // namespace posed::bench
