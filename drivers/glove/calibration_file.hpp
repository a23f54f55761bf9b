// A calibration as a person keeps it: one TOML file for one user and one glove.
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
#pragma once

#include <array>
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
};

// A compiled calibration with the text it came from, which the log keeps.
struct OwnedCalibration {
  std::shared_ptr<const Calibration> calibration;
  std::string text;
  std::string name{};  // of its file, for people
};

// Errors name file and line: cut in half, not finite, raw values that do not ascend. Cold.
[[nodiscard]] Result<CalibrationFile> parse_calibration(const std::string& toml,
                                                        const std::filesystem::path& file);
[[nodiscard]] std::string format_calibration(const CalibrationFile& file);

// The model's default calibration, or what `file` makes of it (sensors it does not name keep their
// default). Refused with a sentence: another driver, another hand, another glove (`identity` empty
// is not compared), unknown sensors, a sensor whose raw values span less than 10 counts (4 % of the
// range of a coarser one). Cold.
[[nodiscard]] Result<std::shared_ptr<const Calibration>> default_calibration(const Model& model);
[[nodiscard]] Result<std::shared_ptr<const Calibration>> make_calibration(
    const Model& model, const CalibrationFile& file, Side hand, const std::string& identity);

}  // namespace posed::drivers::glove
