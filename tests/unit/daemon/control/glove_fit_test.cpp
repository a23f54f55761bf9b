// A glove is judged and fitted by what a page saw its sensors say.
#include "daemon/control/glove_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <catch2/catch.hpp>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/cyberglove/protocol.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "tests/support/has.hpp"

namespace posed::control {
namespace {

using drivers::glove::kPoseNames;
using drivers::glove::kSensorPoses;
using test::has;

drivers::Description right_glove() {
  return drivers::find_driver("cyberglove")
      ->describe(
          "cyberglove hand=right sensors=22 mask=" + std::to_string(drivers::cyberglove::kMask22) +
              " form=8bit mode=stream time=1 status=1 ticks=1280 multiplier=1",
          "")
      .value();
}

// What a glove with default curves sends while the hand holds the pose; it trembles by `unrest` of
// its counts.
void hold(v1::ControlRequest::FitGlove& wanted, std::size_t pose, double unrest) {
  static const auto model = drivers::cyberglove::glove_model(Side::kRight).value();
  const auto hand = drivers::glove::hand_in(static_cast<drivers::glove::Pose>(pose));
  const auto values = drivers::glove::values_of(model, hand).value();
  auto& held = *wanted.add_pose();
  held.set_name(std::string(kPoseNames[pose]));
  for (std::size_t i = 0; i < model.sensors.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    const auto& curve = model.sensors[i].curve;
    const auto at = [&](std::size_t point) {
      return std::pair(static_cast<double>(curve.raw[point]),
                       static_cast<double>(curve.value[point]));
    };
    const auto [raw0, value0] = at(0);
    const auto [raw1, value1] = at(1);
    const double raw = raw0 + (values[i] - value0) * (raw1 - raw0) / (value1 - value0);
    auto& sensor = *held.add_held();
    sensor.set_sensor(model.sensors[i].name);
    sensor.set_count(20);
    sensor.set_sum(20.0 * raw);
    sensor.set_squares(20.0 * (raw * raw + unrest * unrest));
  }
}

v1::ControlRequest::FitGlove poses(double unrest_of_fist) {
  v1::ControlRequest::FitGlove wanted;
  wanted.set_stream("right");
  for (std::size_t p = 0; p < kSensorPoses; ++p) hold(wanted, p, p == 1 ? unrest_of_fist : 0.5);
  return wanted;
}

std::string refusal_of(const v1::ControlRequest::FitGlove& wanted) {
  const auto fitted = fit_glove(right_glove(), "", wanted);
  return fitted ? std::string() : fitted.error().text();
}

}  // namespace

TEST_CASE("poses of a glove are judged at once, and with a name become a calibration", "[glove]") {
  auto wanted = poses(0.5);
  const auto judged = fit_glove(right_glove(), "", wanted).value();
  CHECK(judged.toml.empty());
  REQUIRE(judged.words.verdict_size() == kSensorPoses);
  CHECK(std::ranges::all_of(judged.words.verdict(), &v1::GloveFit::Verdict::good));
  hold(wanted, static_cast<std::size_t>(drivers::glove::Pose::kTouchIndex), 0.5);
  wanted.set_name("ann");
  const auto fitted = fit_glove(right_glove(), "", wanted).value();
  const auto file = drivers::glove::parse_calibration(fitted.toml, "ann.toml").value();
  CHECK(file.user == "ann");
  CHECK(file.driver == "cyberglove");
  CHECK(file.sensors.size() > 10);
  CHECK(has(fitted.words.sentence(0), "thumb to index"));
}

TEST_CASE("contacts alone fit the thumb of the calibration in use, as with all poses", "[glove]") {
  auto all = poses(0.5);
  all.set_name("ann");
  const std::string before = fit_glove(right_glove(), "", all).value().toml;
  v1::ControlRequest::FitGlove contacts;
  contacts.set_stream("right");
  for (auto* wanted : {&all, &contacts}) {
    hold(*wanted, static_cast<std::size_t>(drivers::glove::Pose::kTouchIndex), 0.5);
  }
  CHECK(has(refusal_of(contacts), "no calibration yet: hold the flat hand first"));
  const auto judged = fit_glove(right_glove(), before, contacts).value();
  REQUIRE(judged.words.verdict_size() == 1);
  CHECK(judged.words.verdict(0).good());
  contacts.set_name("ann");
  const auto sensors_of = [](const std::string& toml) {
    return drivers::glove::parse_calibration(toml, "ann.toml").value().sensors;
  };
  const auto alone = sensors_of(fit_glove(right_glove(), before, contacts).value().toml);
  const auto together = sensors_of(fit_glove(right_glove(), "", all).value().toml);
  const auto was = sensors_of(before);
  REQUIRE(alone.size() == together.size());
  for (const auto& [name, points] : alone) {
    INFO(name);
    CHECK(points.front()[1] == Approx(together.at(name).front()[1]).margin(1e-3));
    CHECK(points.back()[1] == Approx(together.at(name).back()[1]).margin(1e-3));
    if (!name.starts_with("thumb")) CHECK(points == was.at(name));
  }
  CHECK(alone != was);
}

TEST_CASE("a glove whose poses were not held is not calibrated", "[glove]") {
  auto wanted = poses(60.0);
  const auto judged = fit_glove(right_glove(), "", wanted).value();
  CHECK_FALSE(judged.words.verdict(1).good());
  CHECK(has(judged.words.verdict(1).sentence(), "moved while it was held"));
  wanted.set_name("ann");
  CHECK(has(refusal_of(wanted), "hold it again"));

  auto strange = poses(0.5);
  strange.mutable_pose(0)->set_name("wave");
  CHECK(has(refusal_of(strange), "there is no pose"));
  auto nothing = poses(0.5);
  nothing.mutable_pose(2)->mutable_held(0)->set_count(0);
  CHECK(has(refusal_of(nothing), "too few values"));
  auto broken = poses(0.5);
  broken.mutable_pose(2)->mutable_held(0)->set_sum(std::numeric_limits<double>::quiet_NaN());
  CHECK_FALSE(refusal_of(broken).empty());
  v1::ControlRequest::FitGlove none;
  none.set_name("ann");
  CHECK_FALSE(refusal_of(none).empty());
}

}  // namespace posed::control
