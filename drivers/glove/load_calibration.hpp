// The text of a calibration file, bounded. What it says is parse_calibration's business.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

inline constexpr std::size_t kMaxCalibrationFile = 64 * 1024;  // bytes, ours or another program's

// A regular file of at most kMaxCalibrationFile, or an Error that names it. Cold.
[[nodiscard]] Result<std::string> load_calibration_text(const std::filesystem::path& path);

}  // namespace posed::drivers::glove
