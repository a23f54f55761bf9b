// Calibrates a glove from the poses that its user held, for `posed calibrate` and the daemon's
// page. Cold; any thread.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

struct PoseCalibration {
  drivers::glove::CalibrationFile file;
  std::shared_ptr<const drivers::glove::Calibration> calibration;  // of the file
  std::vector<std::string> said;      // what the fist and the contacts changed
  std::vector<std::string> warnings;  // sensors that keep their default; what no hand can do
  std::vector<std::string> doubts;    // what makes the verdict a doubtful one
  std::size_t impossible = 0;         // joints that would be bent as no hand's are

  // Says why this cannot be a hand's calibration: six or more joints are impossible. Else empty.
  [[nodiscard]] std::string refusal() const;
};

// Makes a calibration without values for the glove with this `identity`, as its driver says it. The
// path of a port is left out, because the same glove may be plugged in elsewhere tomorrow.
[[nodiscard]] drivers::glove::CalibrationFile blank_calibration(const drivers::glove::Model& model,
                                                                const std::string& identity,
                                                                Side hand, std::string user);

// Completes `blank`: fits the sensors, the fist and then the thumb to the poses.
Result<PoseCalibration> calibrate_by_poses(const drivers::glove::Model& model,
                                           const drivers::glove::Recorded& recorded,
                                           drivers::glove::CalibrationFile blank);

// Fits only the thumb of an existing calibration, to what it touches.
Result<PoseCalibration> calibrate_by_contacts(const drivers::glove::Model& model,
                                              const drivers::glove::Recorded& recorded,
                                              drivers::glove::CalibrationFile file);

// Changes the values of the thumb's sensors in `file` so that the hand touches where the user's
// did. Returns sentences with the gaps before and after; none if no contact was recorded. A thumb
// without a sensor for its opposition is left as it is, with a sentence.
Result<std::vector<std::string>> fit_contacts(const drivers::glove::Model& model,
                                              const drivers::glove::Recorded& recorded, Side hand,
                                              drivers::glove::CalibrationFile& file);

}  // namespace posed::devices
