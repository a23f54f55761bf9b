#include "drivers/glove/pose_check.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "proto/frame/median.hpp"
#include "proto/text/list.hpp"

namespace posed::drivers::glove {
namespace {

// Measured on three real CyberGlove recordings of grasps (GraspDB14) in windows of 2 s. While a
// hand holds still, no sensor moves by more than 0.10 of its span (standard deviation; median
// 0.02), except in one window with 0.12. While it grasps, between 38 % and all of the sensors move
// by more (median 0.2 to 0.4).
constexpr double kMovedShare = 0.1;
// A sensor with a span below this share of its range is measured relative to the range: noise.
constexpr double kMinTravel = 0.04;
// Share of the span between two poses that the driver's default predicts.
constexpr double kStuckShare = 0.1;
constexpr double kFailedShare = 0.25;  // share of a pose's sensors

constexpr std::size_t kNamed = 3;  // sensors named in a sentence

double range_of(const Sensor& sensor) { return sensor.raw_max - sensor.raw_min; }

// By how much the raw value changes, by default, while the calibrated one goes from `from` to `to`.
double default_span(const Sensor& sensor, double from, double to) {
  const auto at = [&](double raw) {
    return static_cast<double>(sensor.curve.value_at(static_cast<float>(raw)));
  };
  const double whole = std::abs(at(sensor.raw_max) - at(sensor.raw_min));
  return whole > 0.0 ? range_of(sensor) * std::abs(to - from) / whole : 0.0;
}

bool is_stuck(const Sensor& sensor, const SensorPoses& at) {
  const double expected = default_span(sensor, at.flat_value, at.pose_value);
  return at.span() < std::max(least_span(sensor), kStuckShare * expected);
}

std::string named(const std::vector<std::string>& sensors) {
  const std::string text = joined(std::span(sensors).first(std::min(sensors.size(), kNamed)));
  return sensors.size() > kNamed ? text + ", ..." : text;
}

bool too_many(std::size_t bad, int all) {
  if (bad == 0) return false;
  return static_cast<double>(bad) > kFailedShare * all && (bad > 1 || all <= static_cast<int>(bad));
}

PoseFinding find(const Model& model, const Recorded& recorded, Pose pose,
                 const std::vector<SensorPoses>& sensors) {
  PoseFinding finding{.pose = pose, .moved = {}, .stuck = {}};
  std::vector<double> unrest;
  for (const SensorPoses& at : sensors) {
    const bool all = pose == Pose::kFlat || touched_finger(pose) != 0;
    if (!all && at.pose != pose) continue;
    const Sensor& sensor = model.sensors[at.sensor];
    ++finding.sensors;
    const double way = std::max(at.span(), kMinTravel * range_of(sensor));
    unrest.push_back(recorded[static_cast<std::size_t>(pose)][at.sensor].deviation() / way);
    if (unrest.back() > kMovedShare) {
      finding.moved.push_back(sensor.name);
    } else if (!all && is_stuck(sensor, at)) {
      finding.stuck.push_back(sensor.name);
    }
  }
  if (!unrest.empty()) finding.unrest = median(unrest);
  return finding;
}

}  // namespace

bool PoseFinding::failed() const { return too_many(moved.size() + stuck.size(), sensors); }

std::string PoseFinding::sentence() const {
  const std::string of_all = " of " + std::to_string(sensors) + " sensors ";
  std::string why;
  if (!moved.empty()) {
    why = std::to_string(moved.size()) + of_all + "moved while it was held (" + named(moved) + ")";
  }
  if (!stuck.empty()) {
    add_word(why, std::to_string(stuck.size()) + of_all + "hardly moved from the flat hand (" +
                      named(stuck) + ")");
  }
  return std::string(kPoseNames[static_cast<std::size_t>(pose)]) + " failed: " + why +
         ": hold it again";
}

std::vector<Pose> PoseCheck::failed() const {
  std::vector<Pose> failed;
  for (const PoseFinding& finding : poses) {
    if (finding.failed()) failed.push_back(finding.pose);
  }
  return failed;
}

std::string PoseCheck::verdict() const {
  std::string text;
  std::vector<std::string> restless;
  double unrest = 0.0;
  for (const PoseFinding& finding : poses) {
    unrest = std::max(unrest, finding.unrest);
    std::ranges::copy(finding.moved, std::back_inserter(restless));
    if (finding.failed()) add_word(text, finding.sentence(), "; ");
  }
  if (!text.empty()) return text;
  return "good: the hand was still in every pose (sensors trembled by " +
         std::to_string(std::lround(100.0 * unrest)) + " % of their movement), " +
         std::to_string(sensors) + " sensors moved between them" +
         (restless.empty() ? "" : "; less still: " + named(restless));
}

Result<PoseCheck> check_poses(const Model& model, const Recorded& recorded) {
  const auto sensors = TRY(poses_of_sensors(model, recorded));
  PoseCheck check;
  check.sensors = static_cast<int>(sensors.size());
  for (std::size_t p = 0; p < kPoses; ++p) {
    if (was_held(recorded[p]))
      check.poses.push_back(find(model, recorded, static_cast<Pose>(p), sensors));
  }
  return check;
}

}  // namespace posed::drivers::glove
