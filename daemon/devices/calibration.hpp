// A calibration file against the glove that a stream has: shared by start, control, supervisor and
// replay, so that the same file means the same everywhere. Cold.
#pragma once

#include <memory>
#include <string>

#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

using OwnedCalibration = drivers::glove::OwnedCalibration;

// `toml` is the file's text, `file` its name for errors. Refused where it does not fit: what is no
// glove, another driver, hand or glove, unknown sensors.
[[nodiscard]] Result<std::unique_ptr<const OwnedCalibration>> compile_calibration(
    const drivers::Description& description, const std::string& toml, const std::string& file);

}  // namespace posed::devices
