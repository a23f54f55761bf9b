#include "drivers/glove/calibration_file.hpp"

#include <algorithm>
#include <functional>
#include <sstream>
#include <string_view>
#include <utility>

#include "drivers/glove/load_calibration.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::drivers::glove {
namespace {

constexpr int kFormat = 1;
// Large enough for 32 sensors of 8 points, the most that a glove has.
constexpr TomlLimits kLimits{
    .what = "calibration", .bytes = kMaxCalibrationFile, .depth = 4, .items = 2048};

constexpr Range kNumbers{-1e6, 1e6};  // of raw values, calibrated values and parameters
constexpr Range kAnyCount{0.0, 1e6};
constexpr std::array<std::string_view, 2> kHands{"right", "left"};

void read_sensor(TableReader& table, const std::string& name, CalibrationFile& file) {
  auto points = table.pairs(name, kNumbers);
  if (!points) return;
  if (points->size() < 2 || points->size() > kMaxCurvePoints) {
    table.add_error(name, "sensor " + in_quotes(name) + " needs 2 to " +
                              std::to_string(kMaxCurvePoints) + " points [raw, calibrated]");
  }
  const auto ascends = [](const auto& a, const auto& b) { return a[0] < b[0]; };
  if (std::ranges::adjacent_find(*points, std::not_fn(ascends)) != points->end()) {
    table.add_error(name, "the raw values of sensor " + in_quotes(name) + " should ascend");
  }
  file.sensors.emplace(name, std::move(*points));
}

// What a file lacks that was cut off at the end of a line.
void check_complete(TableReader& reader, int sensor_count, const CalibrationFile& file) {
  if (file.driver.empty()) reader.add_error("driver", "the calibration does not say its driver");
  reader.need("hand", "write \"right\" or \"left\"");
  if (file.sensors.empty() && file.parameters.empty()) {
    reader.add_error("sensors", "the calibration names no sensor; was the file cut off?");
  }
  if (sensor_count >= 0 && std::cmp_not_equal(sensor_count, file.sensors.size())) {
    reader.add_error("sensor_count", "the calibration should have " + std::to_string(sensor_count) +
                                         " sensors and has " + std::to_string(file.sensors.size()) +
                                         "; was the file cut off?");
  }
}

}  // namespace

Result<CalibrationFile> parse_calibration(const std::string& toml,
                                          const std::filesystem::path& path) {
  const std::string file = path.string();
  const auto table = parse_toml(toml, file, kLimits);
  if (!table) return std::unexpected(table.error());
  Findings findings{.file = file};
  TableReader reader(*table, "", findings);
  int format = 0;
  reader.read("format", format, kAnyCount);
  if (format != kFormat) {
    return fail("is no calibration of a glove (it should say format = 1)", file);
  }
  CalibrationFile read;
  int sensor_count = -1;
  reader.read("driver", read.driver);
  reader.read("glove", read.glove);
  reader.read("user", read.user);
  reader.read("sensor_count", sensor_count, kAnyCount);
  read.hand = reader.choice("hand", kHands) == 0 ? Side::kRight : Side::kLeft;
  if (auto parameters = reader.table("parameters")) {
    for (const std::string& name : parameters->keys()) {
      parameters->read(name, read.parameters[name], kNumbers);
    }
  }
  if (auto sensors = reader.table("sensors")) {
    for (const std::string& name : sensors->keys()) read_sensor(*sensors, name, read);
  }
  reader.finish();
  if (findings.errors.empty()) check_complete(reader, sensor_count, read);
  return findings.result(std::move(read));
}

Result<std::string> load_calibration_text(const std::filesystem::path& path) {
  return load_file(path, {.what = kLimits.what, .max_bytes = kLimits.bytes});
}

std::string format_calibration(const CalibrationFile& file) {
  // toml++ quotes and escapes the characters of names and serial numbers.
  std::ostringstream out;
  out << "format = " << kFormat << "\ndriver = " << toml::value<std::string>(file.driver)
      << "\nglove = " << toml::value<std::string>(file.glove)
      << "\nhand = " << (file.hand == Side::kLeft ? "\"left\"" : "\"right\"")
      << "\nuser = " << toml::value<std::string>(file.user)
      << "\nsensor_count = " << file.sensors.size() << "  # a file cut in half is noticed\n";
  if (!file.parameters.empty()) out << "\n[parameters]\n";
  for (const auto& [name, value] : file.parameters)
    out << name << " = " << clip::number_text(value) << '\n';
  if (!file.sensors.empty()) out << "\n[sensors]  # raw value, calibrated value\n";
  for (const auto& [name, points] : file.sensors) {
    out << name << " = [";
    for (std::size_t i = 0; i < points.size(); ++i) {
      out << (i == 0 ? "[" : ", [") << clip::number_text(points[i][0]) << ", "
          << clip::number_text(points[i][1]) << ']';
    }
    out << "]\n";
  }
  return out.str();
}

}  // namespace posed::drivers::glove
