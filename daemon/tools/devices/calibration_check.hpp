// What `posed calibrate` says about a new calibration: how it differs from the one that the file
// held before. Cold.
#pragma once

#include <string>
#include <vector>

#include "drivers/glove/calibration.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"

namespace posed::tools {

struct Differences {
  // One for each joint that the two calibrations show by more than 5 degrees apart in one of the
  // poses, the largest difference first; else one that says how much they agree.
  std::vector<std::string> sentences;
  int joints = 0;  // that both measure
  int unlike = 0;  // of them, more than 7 degrees apart

  // As of another hand, or of poses that were shown otherwise.
  [[nodiscard]] bool mostly_unlike() const { return 2 * unlike > joints; }
};
[[nodiscard]] Differences differences(const drivers::glove::Model& model,
                                      const drivers::glove::Calibration& before,
                                      const drivers::glove::Calibration& now,
                                      const drivers::glove::Recorded& recorded);

}  // namespace posed::tools
