// The part of a calibration by poses that fits a thumb to what it touched. Cold.
#pragma once

#include <string>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

// Changes the values of the thumb's sensors in `file`, which fit_poses() has made from the same
// poses, so that the hand touches where the user's did. Returns sentences with the gaps before and
// after; none if no contact was recorded. A thumb without a sensor for its opposition is left as it
// is, with a sentence.
Result<std::vector<std::string>> fit_contacts(const drivers::glove::Model& model,
                                              const drivers::glove::Recorded& recorded, Side hand,
                                              drivers::glove::CalibrationFile& file);

}  // namespace posed::devices
