// A calibration as a user keeps it: one TOML file for one user and one glove.
//
//   format = 1
//   driver = "cyberglove"
//   glove = "SERIAL"        # identity; empty fits any glove of the driver
//   hand = "right"
//   user = "ann"
//   sensor_count = 1        # lines under [sensors]; may be left out
//   [parameters]            # the device's own constants, by name
//   abduction_bias = 0.4
//   [sensors]               # raw value, calibrated value; two points or more, raw ascending
//   index_mcp = [[52, 0.0], [181, 1.57]]
//   [crosstalk.index_abd]   # shares of other sensors' values that this one shows; may be left out
//   index_mcp = 0.12
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

struct CalibrationFile {
  std::string driver, glove, user;
  Side hand = Side::kRight;
  std::map<std::string, double> parameters;
  std::map<std::string, std::vector<std::array<double, 2>>> sensors;  // raw, calibrated
  // [sensor][other sensor]: the share of the other's calibrated value that this one's shows
  std::map<std::string, std::map<std::string, double>> crosstalk{};
};

// A compiled calibration with the text from which it was made; the log stores the text.
struct OwnedCalibration {
  std::shared_ptr<const Calibration> calibration;
  std::string text;
  std::string name{};  // file name, for people
};

// Errors name file and line: truncated, not finite, raw values that do not increase. Cold.
Result<CalibrationFile> parse_calibration(const std::string& toml,
                                          const std::filesystem::path& file);
[[nodiscard]] std::string format_calibration(const CalibrationFile& file);

// The model's default calibration, and the one made from `file` (a sensor that the file does not
// name keeps its default). An error for: another driver, another hand, another glove (not checked
// when `identity` is empty), unknown sensors, or a sensor whose raw values span less than 10 counts
// (4 % of the range of a coarser one). Cold.
Result<std::shared_ptr<const Calibration>> default_calibration(const Model& model);
Result<std::shared_ptr<const Calibration>> make_calibration(const Model& model,
                                                            const CalibrationFile& file, Side hand,
                                                            const std::string& identity);

// Loads the text of a calibration file, with a size limit. parse_calibration() checks its content.

// Bytes; for posed's format and those of other programs.
inline constexpr std::size_t kMaxCalibrationFile = 64 * 1024;

// Loads a regular file of at most kMaxCalibrationFile; an Error names it. Cold.
Result<std::string> load_calibration_text(const std::filesystem::path& path);

}  // namespace posed::drivers::glove
