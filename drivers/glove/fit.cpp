#include "drivers/glove/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "drivers/glove/angle_map.hpp"
#include "proto/frame/degree.hpp"

namespace posed::drivers::glove {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
constexpr double kSame = 0.05;  // rad or share: poses that differ by less do not move a sensor

// By so much people's angles differ from the pose's, and glove's gains from the default's: two real
// calibrations of a CyberGlove have gains of 0.5 to 1.5 times the default's.
constexpr double kPoseError_rad = 5.0 * kDegree;
constexpr double kGainSpread = 0.3;

// The value at the pose's raw value: between the pose's and, by its uncertainty, the default's.
double fitted_value(const Sensor& sensor, const SensorPoses& at) {
  const double way = at.pose_value - at.flat_value;
  if (!gain_is_known(sensor) || !(at.by_default > 0.0)) return at.pose_value;
  const double error = std::pow(kPoseError_rad / way, 2);
  const double of_default = error / (error + kGainSpread * kGainSpread);
  return at.flat_value + way * std::pow(at.by_default, of_default);
}

std::size_t channel(std::string_view name) { return hand_channel(name); }

void bend(HandAngles& hand, std::string_view name, double degrees) {
  hand[channel(name)] = degrees * kDegree;
}

// A hand of posed's own shape in which the thumb touches.
void put_thumb(HandAngles& hand, Pose pose) {
  struct Contact {
    double twist, spread, mcp, ip;
  };
  constexpr std::array<Contact, 5> kThumb{
      {{27, 3, 20, 22}, {59, 2, 39, 3}, {77, -6, 15, 21}, {66, -15, 15, 29}, {93, 39, 9, 31}}};
  const auto& at = kThumb[static_cast<std::size_t>(pose) - kSensorPoses];
  bend(hand, "thumb1_z", at.twist);
  bend(hand, "thumb1_y", at.spread);
  bend(hand, "thumb2_x", at.mcp);
  bend(hand, "thumb3_x", at.ip);
  if (pose == Pose::kTouchFist) return;
  const std::string finger(kFingerNames[static_cast<std::size_t>(touched_finger(pose))]);
  bend(hand, finger + "1_x", 45);
  bend(hand, finger + "2_x", 50);
  bend(hand, finger + "3_x", 15);
}

double gain_of(const MapRow& row, const Model& model) {
  return static_cast<double>(row.gain) * model.sensors[row.sensor].map_sign;
}

// The value of a sensor that brings all joints that it moves as near to the hand's as it can, while
// the other sensors' values stay; NaN for one that moves none.
double nearest_value(const std::vector<MapRow>& rows, std::size_t sensor, const Model& model,
                     const HandAngles& hand, const std::vector<double>& values) {
  double along = 0.0, square = 0.0;
  for (const MapRow& row : rows) {
    if (row.sensor != sensor) continue;
    double left_rad = hand[row.channel];
    for (const MapRow& other : rows) {
      if (other.channel != row.channel) continue;
      left_rad -= static_cast<double>(other.offset_rad);
      const bool adds = other.sensor != sensor && std::isfinite(values[other.sensor]);
      if (adds) left_rad -= gain_of(other, model) * values[other.sensor];
    }
    along += gain_of(row, model) * left_rad;
    square += gain_of(row, model) * gain_of(row, model);
  }
  return square > 0.0 ? along / square : kNoValue;
}

// The curves' values of which remove_crosstalk() leaves these.
std::vector<double> shown_of(const Calibration& calibration, const std::vector<double>& values) {
  constexpr int kRounds = 20;  // each makes the error smaller by the size of the shares
  std::vector<double> shown = values;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> next = values;
    for (const Crosstalk& row :
         std::span(calibration.crosstalk).first(calibration.crosstalk_rows)) {
      if (std::isfinite(shown[row.of])) {
        next[row.sensor] += static_cast<double>(row.share) * shown[row.of];
      }
    }
    shown = std::move(next);
  }
  return shown;
}

}  // namespace

HandAngles hand_in(Pose pose) {
  HandAngles hand{};
  if (touched_finger(pose) != 0) put_thumb(hand, pose);
  pose = first_of(pose);
  if (pose == Pose::kFist) {
    for (const std::string finger : {"index", "middle", "ring", "little"}) {
      bend(hand, finger + "1_x", 80);
      bend(hand, finger + "2_x", 100);
      bend(hand, finger + "3_x", 60);
    }
  } else if (pose == Pose::kThumb) {
    bend(hand, "thumb1_z", 45);
    bend(hand, "thumb2_x", 50);
    bend(hand, "thumb3_x", 70);
  } else if (pose == Pose::kSpread) {
    bend(hand, "thumb1_y", 25);
    bend(hand, "index1_y", 15);
    bend(hand, "ring1_y", 12);
    bend(hand, "little1_y", 25);
  }
  return hand;
}

Result<std::vector<double>> values_of(const Model& model, const HandAngles& hand) {
  const auto rows = TRY(
      parse_angle_map(model.map_toml, "config/devices/" + model.driver + ".toml", model.sensors));
  constexpr int kRounds = 30;  // each halves what is left where two values move one joint
  std::vector<double> values(model.sensors.size(), kNoValue);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = nearest_value(rows, i, model, hand, values);
    }
  }
  if (model.uncompute != nullptr) model.uncompute(values);
  return values;
}

double raw_at(const Curve& curve, double value) {
  const auto raw_of = [&](std::size_t i) { return static_cast<double>(curve.raw[i]); };
  const auto value_of = [&](std::size_t i) { return static_cast<double>(curve.value[i]); };
  const bool rises = value_of(curve.points - 1U) > value_of(0);
  std::size_t at = 0;
  while (at + 2 < curve.points && (value_of(at + 1) < value) == rises) ++at;
  const double slope = (value_of(at + 1) - value_of(at)) / (raw_of(at + 1) - raw_of(at));
  return raw_of(at) + (value - value_of(at)) / slope;
}

Result<> add_known_poses(const Model& model, const Calibration& calibration, Recorded& recorded) {
  for (std::size_t p = 0; p < kSensorPoses; ++p) {
    const auto known = TRY(values_of(model, hand_in(static_cast<Pose>(p))));
    const auto values = shown_of(calibration, known);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto of_sensor = [i](const auto& pose) { return pose[i].count > 0; };
      if (std::none_of(recorded.begin() + kSensorPoses, recorded.end(), of_sensor)) continue;
      const double raw = raw_at(calibration.curve[i], values[i]);
      if (std::isfinite(raw)) recorded[p][i] = {.sum = raw, .count = 1, .squares = raw * raw};
    }
  }
  return {};
}

HandAngles angles_of(const Model& model, const Calibration& calibration,
                     std::span<const Held> held) {
  std::array<float, kMaxSensors> value{};
  std::bitset<kMaxSensors> valid;
  const std::size_t sensors = std::min({calibration.sensors, held.size(), value.size()});
  for (std::size_t i = 0; i < sensors; ++i) {
    if (held[i].count == 0) continue;
    value[i] = calibration.curve[i].value_at(static_cast<float>(held[i].mean()));
    valid[i] = std::isfinite(value[i]);
  }
  const std::span<float> values = std::span(value).first(calibration.sensors);
  calibration.remove_crosstalk(values, valid);
  if (model.compute != nullptr) model.compute(calibration, values, valid);
  HandAngles angles{};
  calibration.map_to_hand(values, valid, angles);
  return angles;
}

double Held::deviation() const {
  if (count == 0) return 0.0;
  return std::sqrt(std::max(0.0, squares / static_cast<double>(count) - mean() * mean()));
}

Recorded with_repeats(Recorded recorded) {
  for (std::size_t p = 0; p < kPoses; ++p) {
    const auto first = static_cast<std::size_t>(first_of(static_cast<Pose>(p)));
    for (std::size_t i = 0; i < kMaxSensors && first != p; ++i) {
      const Held& again = recorded[p][i];
      Held& held = recorded[first][i];
      if (held.count == 0 || again.count == 0) continue;
      const double mean = 0.5 * (held.mean() + again.mean());
      held = {.sum = mean, .count = 1, .squares = mean * mean};
    }
  }
  return recorded;
}

bool was_held(std::span<const Held> pose) {
  return std::ranges::any_of(pose, [](const Held& sensor) { return sensor.count > 0; });
}

double SensorPoses::span() const { return std::abs(pose_raw - flat_raw); }

Result<std::vector<SensorPoses>> poses_of_sensors(const Model& model, const Recorded& recorded) {
  std::array<std::vector<double>, kSensorPoses> wanted;
  for (std::size_t p = 0; p < kSensorPoses; ++p) {
    auto values = TRY(values_of(model, hand_in(static_cast<Pose>(p))));
    wanted[p] = std::move(values);
  }
  std::vector<SensorPoses> found;
  for (std::size_t i = 0; i < model.sensors.size(); ++i) {
    const Held& flat = recorded[0][i];
    if (flat.count == 0) continue;  // the glove does not have this sensor
    std::size_t most = 0;
    for (std::size_t p = 1; p < kSensorPoses; ++p) {
      const double moves = std::abs(wanted[p][i] - wanted[0][i]);
      if (recorded[p][i].count > 0 && moves > std::abs(wanted[most][i] - wanted[0][i])) most = p;
    }
    if (!(std::abs(wanted[most][i] - wanted[0][i]) > kSame)) continue;
    const auto by_default = [&](const Held& held) {
      return static_cast<double>(model.sensors[i].curve.value_at(static_cast<float>(held.mean())));
    };
    found.push_back({.sensor = i,
                     .pose = static_cast<Pose>(most),
                     .flat_raw = flat.mean(),
                     .pose_raw = recorded[most][i].mean(),
                     .flat_value = wanted[0][i],
                     .pose_value = wanted[most][i],
                     .by_default = (by_default(recorded[most][i]) - by_default(flat)) /
                                   (wanted[most][i] - wanted[0][i])});
  }
  return found;
}

Result<Fitted> fit_poses(const Model& model, const Recorded& recorded) {
  const auto sensors = TRY(poses_of_sensors(model, recorded));
  if (std::ranges::all_of(recorded[0], [](const Held& flat) { return flat.count == 0; })) {
    return fail("no raw values came while the hand was flat: is the glove sending?");
  }
  Fitted fitted;
  for (const SensorPoses& at : sensors) {
    const Sensor& sensor = model.sensors[at.sensor];
    if (!(at.span() >= least_span(sensor))) {
      fitted.warnings.push_back("sensor " + sensor.name + " hardly moved from flat to " +
                                std::string(kPoseNames[static_cast<std::size_t>(at.pose)]) +
                                ": it keeps its default");
      continue;
    }
    std::vector<std::array<double, 2>> points{{at.flat_raw, at.flat_value},
                                              {at.pose_raw, fitted_value(sensor, at)}};
    std::ranges::sort(points);
    fitted.sensors[sensor.name] = std::move(points);
  }
  if (fitted.sensors.empty()) {
    return fail("no sensor moved between the poses: is the glove worn, and its cable in?");
  }
  return fitted;
}

}  // namespace posed::drivers::glove
