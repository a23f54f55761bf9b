#include "drivers/glove/calibration_file.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "drivers/glove/load_calibration.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/toml.hpp"

namespace posed::drivers::glove {
namespace {

constexpr int kFormat = 1;
// Large enough for 32 sensors of 8 points, the most that a glove has.
constexpr TomlLimits kLimits{
    .what = "calibration", .bytes = kMaxCalibrationFile, .depth = 4, .items = 2048};
constexpr double kMaxNumber = 1e6;  // limit for raw values, calibrated values and parameters

class FileReader : private FirstError {
 public:
  using FirstError::FirstError;

  Result<CalibrationFile> read(const toml::table& table) {
    if (table["format"].value_or(0) != kFormat) {
      return fail("is no calibration of a glove (it should say format = 1)", file());
    }
    for (const auto& [key, node] : table) entry(key.str(), node);
    if (read_.driver.empty()) add_error(table, "the calibration does not say its driver");
    if (hand_.empty()) add_error(table, "the calibration does not say its hand, right or left");
    if (read_.sensors.empty() && read_.parameters.empty()) {
      add_error(table, "the calibration names no sensor; was the file cut off?");
    }
    if (count_ && *count_ != static_cast<std::int64_t>(read_.sensors.size())) {
      add_error(table, "the calibration should have " + std::to_string(*count_) +
                           " sensors and has " + std::to_string(read_.sensors.size()) +
                           "; was the file cut off?");
    }
    if (error()) return std::unexpected(*error());
    return std::move(read_);
  }

 private:
  void entry(std::string_view key, const toml::node& node) {
    if (key == "format") return;
    if (key == "driver") return text(node, read_.driver);
    if (key == "glove") return text(node, read_.glove);
    if (key == "user") return text(node, read_.user);
    if (key == "sensor_count" && node.is_integer()) {
      count_ = node.value<std::int64_t>();
    } else if (key == "hand") {
      text(node, hand_);
      if (hand_ != "right" && hand_ != "left") add_error(node, "hand should be right or left");
      read_.hand = hand_ == "left" ? Side::kLeft : Side::kRight;
    } else if (key == "parameters" && node.is_table()) {
      for (const auto& [name, value] : *node.as_table()) {
        read_.parameters.emplace(name.str(), number(&value));
      }
    } else if (key == "sensors" && node.is_table()) {
      for (const auto& [name, points] : *node.as_table()) read_sensor(name.str(), points);
    } else {
      add_error(node, in_quotes(key) + " is not known in a calibration, or of another type");
    }
  }

  void text(const toml::node& node, std::string& into) {
    const auto value = node.value_exact<std::string>();
    if (!value) return add_error(node, "a text is wanted here");
    into = *value;
  }

  double number(const toml::node* node) {
    const auto value = node->is_number() ? node->value<double>() : std::nullopt;
    if (value && std::abs(*value) <= kMaxNumber) return *value;
    add_error(*node, "a finite number of at most a million is wanted here");
    return 0.0;
  }

  void read_sensor(std::string_view name, const toml::node& node) {
    const toml::array* const points = node.as_array();
    if (points == nullptr || points->size() < 2 || points->size() > kMaxCurvePoints) {
      return add_error(node, "sensor " + in_quotes(name) + " needs 2 to " +
                                 std::to_string(kMaxCurvePoints) + " points [raw, calibrated]");
    }
    auto& read = read_.sensors[std::string(name)];
    for (const toml::node& point : *points) {
      const toml::array* const pair = point.as_array();
      if (pair == nullptr || pair->size() != 2) {
        return add_error(point, "a point of sensor " + in_quotes(name) + " is [raw, calibrated]");
      }
      read.push_back({number(pair->get(0)), number(pair->get(1))});
      if (read.size() > 1 && !(read.back()[0] > read[read.size() - 2][0])) {
        return add_error(point, "the raw values of sensor " + in_quotes(name) + " should ascend");
      }
    }
  }

  CalibrationFile read_;
  std::string hand_;
  std::optional<std::int64_t> count_;
};

}  // namespace

Result<CalibrationFile> parse_calibration(const std::string& toml,
                                          const std::filesystem::path& path) {
  const std::string file = path.string();
  const auto table = parse_toml(toml, file, kLimits);
  if (!table) return std::unexpected(table.error());
  return FileReader(file).read(*table);
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
