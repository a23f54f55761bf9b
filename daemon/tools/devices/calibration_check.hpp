// What `posed calibrate` says about a new calibration: how it differs from the one that the file
// held before. Cold.
#pragma once

#include <string>
#include <vector>

#include "drivers/glove/calibration.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"

namespace posed::tools {

// A sentence for each joint that the two calibrations show by more than 5 degrees apart in one of
// the poses, the largest difference first; else one that says how much they agree.
[[nodiscard]] std::vector<std::string> differences(const drivers::glove::Model& model,
                                                   const drivers::glove::Calibration& before,
                                                   const drivers::glove::Calibration& now,
                                                   const drivers::glove::Recorded& recorded);

}  // namespace posed::tools
