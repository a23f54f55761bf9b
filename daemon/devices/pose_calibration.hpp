// A glove's calibration from the poses that its user held: what `posed calibrate` and the daemon's
// page both make. Cold.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

struct PoseCalibration {
  drivers::glove::CalibrationFile file;
  std::vector<std::string> said;      // what the fist and the contacts changed
  std::vector<std::string> warnings;  // sensors that keep their default; what no hand can do
  std::vector<std::string> doubts;    // what makes the verdict a doubtful one
  std::size_t impossible = 0;         // joints that would be bent as no hand's are

  // Why it is none of a hand, from six such joints on; empty: it may be.
  [[nodiscard]] std::string refusal() const;
};

// The glove that a calibration is for: `identity` as its driver says it. A port's path does not
// identify it, because the same glove may be plugged in elsewhere tomorrow.
[[nodiscard]] drivers::glove::CalibrationFile blank_calibration(const drivers::glove::Model& model,
                                                                const std::string& identity,
                                                                Side hand, std::string user);

Result<PoseCalibration> calibrate_by_poses(const drivers::glove::Model& model,
                                           const drivers::glove::Recorded& recorded,
                                           drivers::glove::CalibrationFile blank);

// The same of a calibration that is there: only the thumb is fitted, to what it touches.
Result<PoseCalibration> calibrate_by_contacts(const drivers::glove::Model& model,
                                              const drivers::glove::Recorded& recorded,
                                              drivers::glove::CalibrationFile file);

// Changes the values of the thumb's sensors in `file`, which fit_poses() has made from the same
// poses, so that the hand touches where the user's did. Returns sentences with the gaps before and
// after; none if no contact was recorded. A thumb without a sensor for its opposition is left as it
// is, with a sentence.
Result<std::vector<std::string>> fit_contacts(const drivers::glove::Model& model,
                                              const drivers::glove::Recorded& recorded, Side hand,
                                              drivers::glove::CalibrationFile& file);

}  // namespace posed::devices
