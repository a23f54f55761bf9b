// Whether recorded poses are good enough for a calibration.
#include "drivers/glove/pose_check.hpp"

#include <catch2/catch.hpp>

#include <cmath>

#include "drivers/driver.hpp"
#include "drivers/glove/traits.hpp"

namespace posed::drivers::glove {
namespace {

Model cyberglove() {
  const Driver* driver = find_driver("cyberglove");
  return driver->glove->glove_model(driver->expect({}).value()).value();
}

// The raw value that the default calibration maps to `value`.
double raw_of(const Sensor& sensor, double value) {
  double best = sensor.raw_min;
  for (double raw = sensor.raw_min; raw <= sensor.raw_max; ++raw) {
    const auto at = [&](double r) {
      return std::abs(static_cast<double>(sensor.curve.value_at(static_cast<float>(r))) - value);
    };
    if (at(raw) < at(best)) best = raw;
  }
  return best;
}

// All four poses, held for 200 samples with a sway of `unrest` counts.
Recorded held(const Model& model, double unrest = 0.5) {
  Recorded recorded{};
  for (std::size_t p = 0; p < kPoses; ++p) {
    const auto wanted = values_of(model, hand_in(static_cast<Pose>(p))).value();
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
      if (!std::isfinite(wanted[i])) continue;
      const double raw = raw_of(model.sensors[i], wanted[i]);
      for (int t = 0; t < 200; ++t) {
        recorded[p][i].add(static_cast<float>(raw + unrest * std::sin(0.1 * t)));
      }
    }
  }
  return recorded;
}

}  // namespace

TEST_CASE("poses held still are good, and the verdict says how still") {
  const Model model = cyberglove();
  const auto check = check_poses(model, held(model)).value();
  INFO(check.verdict());
  CHECK(check.usable());
  CHECK(check.poses.size() == kPoses);
  CHECK(check.verdict().starts_with("good: the hand was still in every pose"));
}

TEST_CASE("the verdict on good poses names a sensor that was less still") {
  const Model model = cyberglove();
  Recorded recorded = held(model);
  const auto fist = static_cast<std::size_t>(Pose::kFist);
  const Recorded restless = held(model, 60.0);
  const auto sensors = poses_of_sensors(model, recorded).value();
  const auto one = std::ranges::find(sensors, Pose::kFist, &SensorPoses::pose);
  REQUIRE(one != sensors.end());
  recorded[fist][one->sensor] = restless[fist][one->sensor];
  const auto check = check_poses(model, recorded).value();
  INFO(check.verdict());
  CHECK(check.usable());
  CHECK(check.verdict().ends_with("; less still: " + model.sensors[one->sensor].name));
}

TEST_CASE("a hand that moved in every pose fails every pose") {
  const Model model = cyberglove();
  const auto check = check_poses(model, held(model, 60.0)).value();
  INFO(check.verdict());
  CHECK_FALSE(check.usable());
  CHECK(check.failed().size() == kPoses);
  CHECK(check.verdict().contains("moved while it was held"));
}

TEST_CASE("a hand that moved in one pose fails that one: hold it again") {
  const Model model = cyberglove();
  Recorded recorded = held(model);
  recorded[static_cast<std::size_t>(Pose::kThumb)] =
      held(model, 60.0)[static_cast<std::size_t>(Pose::kThumb)];
  const auto check = check_poses(model, recorded).value();
  INFO(check.verdict());
  CHECK(check.failed() == std::vector{Pose::kThumb});
  CHECK(check.verdict().starts_with("thumb failed: "));
  CHECK(check.verdict().ends_with(": hold it again"));
}

TEST_CASE("one sensor that hardly moved is a broken sensor, many are a pose that was not taken") {
  const Model model = cyberglove();
  const auto with_stuck = [&](std::size_t many) {
    Recorded recorded = held(model);
    std::size_t stuck = 0;
    const auto rests = poses_of_sensors(model, recorded).value();
    for (const SensorPoses& at : rests) {
      if (at.pose != Pose::kFist || stuck == many) continue;
      for (auto& pose : recorded) pose[at.sensor] = recorded[0][at.sensor];
      ++stuck;
    }
    REQUIRE(stuck == many);
    return check_poses(model, recorded).value();
  };
  CHECK(with_stuck(1).usable());
  const auto check = with_stuck(7);
  INFO(check.verdict());
  CHECK(check.failed() == std::vector{Pose::kFist});
  CHECK(check.verdict().contains("hardly moved from the flat hand"));
}

}  // namespace posed::drivers::glove
