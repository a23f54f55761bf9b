// Combines a model and a user's calibration file into the Calibration that decoders use.
#include "drivers/glove/calibration_file.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <string_view>
#include <utility>

#include "drivers/glove/angle_map.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/glove/fit.hpp"
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
constexpr Range kShares{-2.0, 2.0};  // of another sensor's value
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

// Detects files truncated at a line end.
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
  const auto table = TRY(parse_toml(toml, file, kLimits));
  Findings findings{.file = file};
  TableReader reader(table, "", findings);
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
  if (auto crosstalk = reader.table("crosstalk")) {
    for (const std::string& name : crosstalk->keys()) {
      auto shares = crosstalk->table(name);
      if (!shares) continue;
      for (const std::string& other : shares->keys()) {
        shares->read(other, read.crosstalk[name][other], kShares);
      }
    }
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
  for (const auto& [name, shares] : file.crosstalk) {
    out << "\n[crosstalk." << name << "]  # shares of other sensors' values that it shows\n";
    for (const auto& [other, share] : shares) {
      out << other << " = " << clip::number_text(share) << '\n';
    }
  }
  return out.str();
}

namespace {

// A mistake in a driver's curve appears in the first test that opens the driver.
bool is_valid(const Curve& curve) {
  bool valid = curve.points >= 2 && curve.points <= kMaxCurvePoints;
  for (std::size_t i = 0; valid && i < curve.points; ++i) {
    valid = std::isfinite(curve.raw[i]) && std::isfinite(curve.value[i]) &&
            (i == 0 || curve.raw[i] > curve.raw[i - 1]);
  }
  return valid;
}

Result<Calibration> compile(const Model& model) {
  Calibration made;
  if (model.sensors.empty() || model.sensors.size() > kMaxSensors ||
      model.parameters.size() > kMaxParameters) {
    return fail("driver " + in_quotes(model.driver) +
                " states a glove without sensors, or with more " + "than " +
                std::to_string(kMaxSensors) + ": mend the driver");
  }
  made.sensors = model.sensors.size();
  for (std::size_t i = 0; i < made.sensors; ++i) {
    const Sensor& sensor = model.sensors[i];
    if (!is_valid(sensor.curve)) {
      return fail("sensor " + in_quotes(sensor.name) + " of driver " + in_quotes(model.driver) +
                  " needs a default curve of ascending finite points: mend the driver");
    }
    made.curve[i] = sensor.curve;
  }
  for (std::size_t i = 0; i < model.parameters.size(); ++i) {
    made.parameter[i] = static_cast<float>(model.parameters[i].second);
  }
  if (model.map_toml.empty()) return made;
  const auto rows = TRY(
      parse_angle_map(model.map_toml, "config/devices/" + model.driver + ".toml", model.sensors));
  for (const MapRow& row : rows) {
    made.map[made.map_rows] = row;
    made.map[made.map_rows++].gain *= static_cast<float>(model.sensors[row.sensor].map_sign);
  }
  return made;
}

Result<> check_owner(const Model& model, const CalibrationFile& file, Side hand,
                     const std::string& identity) {
  if (file.driver != model.driver) {
    return fail("this calibration is for driver " + in_quotes(file.driver) + ", the glove is a " +
                in_quotes(model.driver) + ": calibrate this glove");
  }
  if (file.hand != hand) {
    return fail("this calibration is for the " + std::string(side_name(file.hand)) +
                " hand, the glove is the " + std::string(side_name(hand)) +
                " one: use that hand's file");
  }
  if (!file.glove.empty() && !identity.empty() && file.glove != identity) {
    return fail("this calibration is for glove " + in_quotes(file.glove) + ", this one is " +
                in_quotes(identity) + ": calibrate this glove, or leave `glove` empty in the file");
  }
  return {};
}

Result<> set_curve(const Sensor& sensor, const std::vector<std::array<double, 2>>& points,
                   Curve& curve) {
  if (points.size() < 2 || points.size() > kMaxCurvePoints) {
    return fail("sensor " + in_quotes(sensor.name) + " needs 2 to " +
                std::to_string(kMaxCurvePoints) + " points");
  }
  curve.points = static_cast<std::uint8_t>(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    curve.raw[i] = static_cast<float>(points[i][0]);
    curve.value[i] = static_cast<float>(points[i][1]);
  }
  if (!is_valid(curve)) {
    return fail("the raw values of sensor " + in_quotes(sensor.name) + " should ascend");
  }
  if (points.back()[0] - points.front()[0] < least_span(sensor)) {
    return fail("sensor " + in_quotes(sensor.name) +
                " hardly moved in this calibration: calibrate again, or delete its line");
  }
  return {};
}

Result<std::size_t> sensor_named(const Model& model, const std::string& name) {
  const auto sensor = std::ranges::find(model.sensors, name, &Sensor::name);
  if (sensor != model.sensors.end()) {
    return static_cast<std::size_t>(sensor - model.sensors.begin());
  }
  return fail("the glove has no sensor " + in_quotes(name) + ": is the calibration another's?");
}

Result<> set_crosstalk(const Model& model, const CalibrationFile& file, Calibration& made) {
  for (const auto& [name, shares] : file.crosstalk) {
    const auto sensor = TRY(sensor_named(model, name));
    for (const auto& [other, share] : shares) {
      const auto of = TRY(sensor_named(model, other));
      if (made.crosstalk_rows == kMaxCrosstalk) {
        return fail("[crosstalk] has more than " + std::to_string(kMaxCrosstalk) + " shares");
      }
      made.crosstalk[made.crosstalk_rows++] = {.sensor = static_cast<std::uint8_t>(sensor),
                                               .of = static_cast<std::uint8_t>(of),
                                               .share = static_cast<float>(share)};
    }
  }
  return {};
}

}  // namespace

// A sensor that hardly moved during calibration would turn its noise into motion.
double least_span(const Sensor& sensor) {
  constexpr double kCounts = 10.0;
  constexpr double kShareOfRange = 0.04;
  return std::min(kCounts, kShareOfRange * (sensor.raw_max - sensor.raw_min));
}

Result<std::shared_ptr<const Calibration>> default_calibration(const Model& model) {
  const auto made = TRY(compile(model));
  return std::make_shared<const Calibration>(made);
}

Result<std::shared_ptr<const Calibration>> make_calibration(const Model& model,
                                                            const CalibrationFile& file, Side hand,
                                                            const std::string& identity) {
  TRY(check_owner(model, file, hand, identity));
  auto made = TRY(compile(model));
  for (const auto& [name, points] : file.sensors) {
    const auto index = TRY(sensor_named(model, name));
    TRY(set_curve(model.sensors[index], points, made.curve[index]));
  }
  TRY(set_crosstalk(model, file, made));
  for (const auto& [name, value] : file.parameters) {
    const auto at =
        std::ranges::find(model.parameters, name, &std::pair<std::string, double>::first);
    if (at == model.parameters.end()) {
      return fail("the glove has no parameter " + in_quotes(name) +
                  ": is the calibration another's?");
    }
    made.parameter[at - model.parameters.begin()] = static_cast<float>(value);
  }
  return std::make_shared<const Calibration>(made);
}

}  // namespace posed::drivers::glove
