// Calibrations that other programs made of a CyberGlove: VirtualHand and Device Configuration
// Utility (.cal), asr_cyberglove_lib (.cal, "rad:raw rad:raw"), Shadow's ROS driver (XML).
#pragma once

#include <filesystem>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// The file's kind is told by its content. The glove's identity and the user stay empty: the files
// do not say them. Errors name file and line: of no known kind, cut off, a sensor that hardly
// moved, another hand, another driver than cyberglove. Cold.
[[nodiscard]] Result<CalibrationFile> import_calibration(const std::filesystem::path& path,
                                                         const Model& model, Side hand);

}  // namespace posed::drivers::glove
