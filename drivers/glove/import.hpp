// Imports CyberGlove calibrations of other programs: VirtualHand and Device Configuration Utility
// (.cal), asr_cyberglove_lib (.cal, "rad:raw rad:raw"), Shadow's ROS driver (XML).
#pragma once

#include <filesystem>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// The kind of file is detected from its content. The glove's identity and the user stay empty,
// because the files do not contain them. Errors name file and line: unknown kind, truncated file, a
// sensor that hardly moved, another hand, a driver other than cyberglove. Cold.
Result<CalibrationFile> import_calibration(const std::filesystem::path& path, const Model& model,
                                           Side hand);

}  // namespace posed::drivers::glove
