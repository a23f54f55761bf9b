#include "drivers/glove/possible_angles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "proto/frame/degree.hpp"

namespace posed::drivers::glove {
namespace {

struct PossibleRange {
  double least_deg, most_deg;
};
// What a flexible hand can do, with 10 degrees for a glove's errors: [joint] flexion of a finger,
// of the thumb, and spread of a finger's first joint.
constexpr std::array<PossibleRange, 3> kFingerRange{{{-50, 110}, {-25, 130}, {-25, 110}}};
constexpr std::array<PossibleRange, 3> kThumbRange{{{-60, 60}, {-40, 80}, {-35, 100}}};
constexpr PossibleRange kSpreadRange{-40, 40};

// What is known of the channel; the thumb's spread and every twist are not judged.
const PossibleRange* possible(std::size_t channel) {
  const std::size_t finger = channel / kFingerChannels;
  const std::size_t joint = channel % kFingerChannels / 3;
  if (channel % 3 == 0) return finger == 0 ? &kThumbRange[joint] : &kFingerRange[joint];
  return channel % 3 == 1 && finger > 0 && joint == 0 ? &kSpreadRange : nullptr;
}

struct Worst {
  double beyond_deg = 0.0, angle_deg = 0.0;
  std::size_t pose = 0;
};

std::array<Worst, kHandChannels> worst_poses(const Model& model, const Calibration& calibration,
                                             const Recorded& recorded) {
  std::array<Worst, kHandChannels> worst{};
  for (std::size_t pose = 0; pose < recorded.size(); ++pose) {
    if (!was_held(recorded[pose])) continue;
    const HandAngles angles = angles_of(model, calibration, recorded[pose]);
    for (std::size_t c = 0; c < angles.size(); ++c) {
      const PossibleRange* const range = possible(c);
      const double deg = angles[c] / kDegree;
      if (range == nullptr || !std::isfinite(deg)) continue;
      const double beyond_deg = std::max(range->least_deg - deg, deg - range->most_deg);
      if (beyond_deg > worst[c].beyond_deg) worst[c] = {beyond_deg, deg, pose};
    }
  }
  return worst;
}

// The sensor that alone moves the channel.
std::optional<std::size_t> only_sensor(const Calibration& calibration, std::size_t channel) {
  std::optional<std::size_t> found;
  for (const MapRow& row : std::span(calibration.map).first(calibration.map_rows)) {
    if (row.channel != channel) continue;
    if (found) return std::nullopt;
    found = row.sensor;
  }
  return found;
}

// The raw value between the flat hand's and the pose's at which the joint reaches its limit.
double raw_at(const Model& model, const Calibration& calibration, const Recorded& recorded,
              std::size_t sensor, std::size_t channel, const Worst& worst, double limit_deg) {
  auto held = recorded[worst.pose];
  double inside = recorded[0][sensor].mean();
  double outside = held[sensor].mean();
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (inside + outside);
    held[sensor] = {.sum = middle, .count = 1};
    const double deg = angles_of(model, calibration, held)[channel] / kDegree;
    const bool beyond = worst.angle_deg < 0.0 ? deg < limit_deg : deg > limit_deg;
    (beyond ? outside : inside) = middle;
  }
  return inside;
}

// The curve stays where it is up to `raw`, and at this height beyond it on the pose's side; false
// where that leaves no curve.
bool end_curve(std::vector<std::array<double, 2>>& points, const Curve& curve, double raw,
               bool upwards) {
  constexpr double kFlat = 1.0;  // counts after which the curve is flat for good
  const double value = static_cast<double>(curve.value_at(static_cast<float>(raw)));
  std::erase_if(points, [&](const auto& at) { return upwards ? at[0] >= raw : at[0] <= raw; });
  points.push_back({raw, value});
  points.push_back({upwards ? raw + kFlat : raw - kFlat, value});
  std::ranges::sort(points);
  return points.size() > 2 && points.size() <= kMaxCurvePoints;
}

}  // namespace

std::string joint_words(std::size_t channel) {
  constexpr std::array<const char*, 3> kFingerJoint{"MCP", "PIP", "DIP"};
  constexpr std::array<const char*, 3> kThumbJoint{"CMC", "MCP", "IP"};
  constexpr std::array<const char*, 3> kAxis{"", " spread", " twist"};
  const std::size_t finger = channel / kFingerChannels;
  const std::size_t joint = channel % kFingerChannels / 3;
  return fmt::format("{} {}{}", kFingerNames[finger],
                     finger == 0 ? kThumbJoint[joint] : kFingerJoint[joint], kAxis[channel % 3]);
}

Result<std::vector<std::string>> keep_possible(const Model& model, const Recorded& recorded,
                                               Side hand, CalibrationFile& file) {
  std::vector<std::string> sentences;
  const auto before = TRY(make_calibration(model, file, hand, /*identity=*/""));
  const auto worst = worst_poses(model, *before, recorded);
  for (std::size_t c = 0; c < worst.size(); ++c) {
    if (worst[c].beyond_deg == 0.0) continue;
    const PossibleRange range = *possible(c);
    const double limit_deg = worst[c].angle_deg < 0.0 ? range.least_deg : range.most_deg;
    const auto sensor = only_sensor(*before, c);
    CalibrationFile kept = file;
    bool held = false;
    if (sensor && recorded[0][*sensor].count > 0 && recorded[worst[c].pose][*sensor].count > 0) {
      const auto points = kept.sensors.find(model.sensors[*sensor].name);
      const double raw = raw_at(model, *before, recorded, *sensor, c, worst[c], limit_deg);
      const bool upwards = recorded[worst[c].pose][*sensor].mean() > raw;
      held = points != kept.sensors.end() &&
             end_curve(points->second, before->curve[*sensor], raw, upwards);
    }
    const auto after = held ? make_calibration(model, kept, hand, /*identity=*/"") : before;
    held = held && after && worst_poses(model, **after, recorded)[c].beyond_deg < 0.5;
    if (held) file = std::move(kept);
    sentences.push_back(fmt::format(
        "{} would be at {:.0f} degrees in the pose {}, which no hand can do: {}; calibrate again, "
        "and if it stays, look at the sensor",
        joint_words(c), worst[c].angle_deg, kPoseNames[worst[c].pose],
        held ? fmt::format("it stops at {:.0f}", limit_deg)
             : fmt::format("at most {:.0f}", limit_deg)));
  }
  return sentences;
}

}  // namespace posed::drivers::glove
