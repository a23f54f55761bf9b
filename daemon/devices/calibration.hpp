// Compiles a calibration file for the glove of a stream. Start, control, supervisor and replay
// share this code, so that a file means the same everywhere. Cold.
#pragma once

#include <memory>
#include <string>

#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

using OwnedCalibration = drivers::glove::OwnedCalibration;

// `toml` is the file's text, `file` its name for errors. Refuses a calibration that does not fit:
// the device is not a glove, the file is for another driver, hand or glove, or it names unknown
// sensors.
Result<std::unique_ptr<const OwnedCalibration>> compile_calibration(
    const drivers::Description& description, const std::string& toml, const std::string& file);

}  // namespace posed::devices
