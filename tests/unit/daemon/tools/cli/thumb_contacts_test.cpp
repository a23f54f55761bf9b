// `posed calibrate` with contacts: the thumb touches where the user's did.
#include "daemon/devices/pose_calibration.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "drivers/cyberglove/angles.hpp"
#include "models/hand/geometry.hpp"
#include "models/hand/thumb_fit.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/has.hpp"

namespace posed::tools {
namespace {

using namespace drivers::glove;
using devices::fit_contacts;
using test::has;

// What a glove with default curves sends while the hand is in this pose, its thumb's zeros off.
void hold(const Model& model, const HandAngles& hand, std::array<Held, kMaxSensors>& held) {
  std::vector<double> values = values_of(model, hand).value();
  for (std::size_t i = 0; i < model.sensors.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    const Curve& curve = model.sensors[i].curve;
    const double slope =
        static_cast<double>((curve.value[1] - curve.value[0]) / (curve.raw[1] - curve.raw[0]));
    const double raw = static_cast<double>(curve.raw[0]) +
                       (values[i] - static_cast<double>(curve.value[0])) / slope;
    held[i].add(static_cast<float>(raw));
  }
}

// The gap that the calibrated hand shows between thumb and finger while they touch [mm].
double shown_mm(const Model& model, const CalibrationFile& file, const Recorded& recorded,
                Pose pose) {
  const auto calibration = make_calibration(model, file, Side::kRight, "").value();
  HandAngles angles = angles_of(model, *calibration, recorded[static_cast<std::size_t>(pose)]);
  for (double& angle : angles) angle = std::isfinite(angle) ? angle : 0.0;
  return 1e3 *
         hand::thumb_gap_m(hand::hand_geometry(default_hand_shape()), angles, touched_finger(pose));
}

// As `posed calibrate` has it before it looks at contacts.
CalibrationFile fitted(const Model& model, const Recorded& recorded) {
  return {.driver = "cyberglove",
          .glove = {},
          .user = "ann",
          .hand = Side::kRight,
          .parameters = {},
          .sensors = fit_poses(model, recorded).value().sensors};
}

}  // namespace

TEST_CASE("a thumb calibrated with contacts touches where it touched") {
  const Model model = drivers::cyberglove::glove_model(Side::kRight).value();
  Recorded recorded{};
  for (std::size_t p = 0; p < kSensorPoses; ++p)
    hold(model, hand_in(static_cast<Pose>(p)), recorded[p]);
  // What this hand does to touch: with the default map the thumb is centimetres away, or inside.
  for (const auto& [pose, roll, spread, bend] : {std::tuple{Pose::kTouchIndex, 20.0, -6.0, 40.0},
                                                 {Pose::kTouchMiddle, 30.0, -10.0, 40.0},
                                                 {Pose::kTouchRing, 40.0, -15.0, 45.0},
                                                 {Pose::kTouchLittle, 48.0, -20.0, 50.0},
                                                 {Pose::kTouchFist, 45.0, -10.0, 80.0}}) {
    HandAngles hand{};
    const auto finger = static_cast<std::size_t>(touched_finger(pose));
    for (std::size_t joint = 0; joint < 3; ++joint) {
      hand[kFingerChannels * finger + 3 * joint] = bend * kDegree;
    }
    hand[2] = roll * kDegree;
    hand[1] = spread * kDegree;
    hand[6] = 20 * kDegree;
    hold(model, hand, recorded[static_cast<std::size_t>(pose)]);
  }
  CalibrationFile file = fitted(model, recorded);
  const CalibrationFile before = file;
  const auto sentences = fit_contacts(model, recorded, Side::kRight, file).value();
  REQUIRE(sentences.size() == 5);
  CHECK(sentences[0].starts_with("thumb to index "));
  double sum_before = 0.0, sum_after = 0.0;
  for (const Pose pose :
       {Pose::kTouchIndex, Pose::kTouchMiddle, Pose::kTouchRing, Pose::kTouchLittle}) {
    sum_before += std::abs(shown_mm(model, before, recorded, pose));
    sum_after += std::abs(shown_mm(model, file, recorded, pose));
  }
  CHECK(sum_after < 0.5 * sum_before);
  CHECK(sum_after < 4 * 8.0);
  CHECK(file.sensors.at("index_mcp") == before.sensors.at("index_mcp"));
}

TEST_CASE("the verdict rests on poses held twice and on what the thumb touched") {
  const Model model = drivers::cyberglove::glove_model(Side::kRight).value();
  const auto made = [&](double fist_deg, const HandAngles& touching) {
    Recorded recorded{};
    for (std::size_t p = 0; p < kPoses; ++p) {
      HandAngles hand = hand_in(static_cast<Pose>(p));
      if (static_cast<Pose>(p) == Pose::kTouchFist) hand[kFingerChannels] += fist_deg * kDegree;
      if (static_cast<Pose>(p) == Pose::kTouchRing) hand = touching;
      hold(model, hand, recorded[p]);
    }
    CalibrationFile blank = fitted(model, recorded);
    blank.sensors.clear();
    return devices::calibrate_by_poses(model, recorded, blank).value();
  };
  const auto good = made(0.0, hand_in(Pose::kTouchRing));
  CHECK(good.doubts.empty());
  CHECK(has(good.said.back(), "poses held twice differed by 0.0 degrees"));
  const auto loose = made(-30.0, hand_in(Pose::kTouchRing));
  REQUIRE(loose.doubts.size() == 1);
  CHECK(has(loose.doubts[0], "most index MCP by 37"));
  const auto apart = made(0.0, HandAngles{});
  CHECK(std::ranges::any_of(apart.doubts, [](const auto& doubt) {
    return has(doubt, "the thumb that touched the ring");
  }));

  Recorded brief{};
  for (std::size_t p = 0; p < kSensorPoses; ++p) {
    hold(model, hand_in(static_cast<Pose>(p)), brief[p]);
  }
  const auto once = devices::calibrate_by_poses(model, brief, fitted(model, brief)).value();
  REQUIRE(once.doubts.size() == 1);
  CHECK(has(once.doubts[0], "no pose was held twice"));
}

TEST_CASE("without contacts a calibration stays as it is") {
  const Model model = drivers::cyberglove::glove_model(Side::kRight).value();
  Recorded recorded{};
  for (std::size_t p = 0; p < kSensorPoses; ++p)
    hold(model, hand_in(static_cast<Pose>(p)), recorded[p]);
  CalibrationFile file = fitted(model, recorded);
  const auto before = file.sensors;
  CHECK(fit_contacts(model, recorded, Side::kRight, file).value().empty());
  CHECK(file.sensors == before);
}

}  // namespace posed::tools
