// Loads the text of a calibration file, with a size limit. parse_calibration() checks its content.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// Bytes; for posed's format and those of other programs.
inline constexpr std::size_t kMaxCalibrationFile = 64 * 1024;

// Loads a regular file of at most kMaxCalibrationFile; an Error names it. Cold.
[[nodiscard]] Result<std::string> load_calibration_text(const std::filesystem::path& path);

}  // namespace posed::drivers::glove
