// Imported calibrations of other programs (real ones where available), and fits from poses.
#include <catch2/catch.hpp>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/glove/angle_map.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/import.hpp"
#include "drivers/glove/traits.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/load_file.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"

namespace posed::drivers::glove {
namespace {

Model cyber_model(Side hand = Side::kRight) { return cyberglove::glove_model(hand).value(); }

Result<CalibrationFile> import_text(const std::string& text, Side hand = Side::kRight) {
  return import_calibration(test::scratch_file("import.cal", text), cyber_model(hand), hand);
}

std::string virtual_hand(char side) {
  std::string text = "VHv2.0\n! made up\nGLOVE CALIBRATION follows:\n";
  for (int finger = 0; finger < 6; ++finger) {
    text += "FINGER " + std::to_string(finger) + ":\n";
    for (int joint = 0; joint < 4; ++joint) {
      text += "  " + std::to_string(joint) + " " + std::to_string(60 + 4 * finger + joint) +
              "\t 0.0" + std::to_string(10 + 4 * finger + joint) + " 0\n";
    }
  }
  return text + "3D HAND GEOMETRY\n" + side + "\n1.0 2.0 3.0\n! E_O_F\n";
}

// The calibrated value of the sensor for this raw value.
double value_at(const CalibrationFile& file, const std::string& sensor, double raw) {
  const auto& points = file.sensors.at(sensor);
  const double slope =
      (points.back()[1] - points.front()[1]) / (points.back()[0] - points.front()[0]);
  return points.front()[1] + slope * (raw - points.front()[0]);
}

void check_every_cut(const std::string& text) {
  for (std::size_t length = 0; length < text.size() * 9 / 10; length += 7) {
    INFO(length);
    const auto cut = import_text(text.substr(0, length));
    CHECK_FALSE(cut);
    if (!cut) CHECK(cut.error().message.find('\n') == std::string::npos);
  }
}

Recorded recorded_by(const Model& model, std::size_t stuck) {
  Recorded recorded{};
  for (std::size_t p = 0; p < kPoses; ++p) {
    const auto values = values_of(model, hand_in(static_cast<Pose>(p))).value();
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
      if (i == cyberglove::kIndexAbd) continue;  // no sensor
      // A hand whose sensors are half as steep as the default ones, and one that does not move.
      const double turn = std::isfinite(values[i]) && i != stuck ? values[i] : 0.0;
      recorded[p][i].add(static_cast<float>(100.0 - turn * 50.0));
      recorded[p][i].add(static_cast<float>(102.0 - turn * 50.0));
    }
  }
  return recorded;
}

}  // namespace

TEST_CASE("a VirtualHand calibration is imported by its formula") {
  const auto file = import_text(virtual_hand('R'));
  if (!file) FAIL(file.error().text());
  CHECK(file->sensors.size() == 22);
  CHECK(value_at(*file, "index_mcp", 64 + 10) == Approx(-0.014 * 10));
  // The sensor between index and middle: the "index abduction" gain, and the other sign.
  CHECK(value_at(*file, "middle_abd", 71 + 10) == Approx(0.017 * 10));
  CHECK(value_at(*file, "wrist_yaw", 82 + 1) == Approx(-0.032));
  CHECK(file->parameters.at("abduction_bias") == Approx(0.021));
  const auto made = make_calibration(cyber_model(), *file, Side::kRight, "any");
  CHECK(made);
}

TEST_CASE("a VirtualHand calibration of the other hand, cut or out of order, is refused") {
  const auto other = import_text(virtual_hand('L'));
  REQUIRE_FALSE(other);
  CHECK(other.error().message.contains("other hand"));
  CHECK(import_text(virtual_hand('L'), Side::kLeft));
  const std::string text = virtual_hand('R');
  for (std::size_t length = 0; length < text.find("3D HAND") - 20; length += 5) {
    INFO(length);
    CHECK_FALSE(import_text(text.substr(0, length)));
  }
  std::string swapped = text;
  swapped.replace(swapped.find("  1 61"), 6, "  2 61");
  CHECK_FALSE(import_text(swapped));
}

TEST_CASE("asr's real calibrations are imported, and cut ones refused") {
  const auto folder = test::shared("data/gloves/calibrations");
  if (!folder) SKIP_WITHOUT_SHARED();
  for (const auto& [name, hand] : {std::pair{"GloveCalibrationRight.cal", Side::kRight},
                                   std::pair{"GloveCalibrationLeft.cal", Side::kLeft}}) {
    const auto file = import_calibration(*folder / name, cyber_model(hand), hand);
    if (!file) FAIL(file.error().text());
    CHECK(file->sensors.size() == 21);
    CHECK(file->hand == hand);
  }
  const auto right =
      import_calibration(*folder / "GloveCalibrationRight.cal", cyber_model(), Side::kRight);
  CHECK(value_at(*right, "index_mcp", 117) == Approx(0.0));
  CHECK(value_at(*right, "index_mcp", 185) == Approx(-1.5));
  CHECK(value_at(*right, "wrist_yaw", 46) == Approx(0.3));
  check_every_cut(load_file(*folder / "GloveCalibrationRight.cal", {"file", 1 << 20}).value());
}

TEST_CASE("Shadow's real calibration is imported, and a cut one refused") {
  const auto folder = test::shared("data/gloves/calibrations");
  if (!folder) SKIP_WITHOUT_SHARED();
  const auto path = *folder / "shadow_cyberglove.cal.xml";
  const auto file = import_calibration(path, cyber_model(), Side::kRight);
  if (!file) FAIL(file.error().text());
  CHECK(file->sensors.size() == 22);
  CHECK(value_at(*file, "index_pip", 1 + 254 * 0.653543293476) == Approx(-90 * kDegree));
  CHECK(value_at(*file, "index_pip", 1 + 254 * 0.181102365255) == Approx(0).margin(1e-9));
  check_every_cut(load_file(path, {"file", 1 << 20}).value());
}

TEST_CASE("files that are not calibrations, and sensors that hardly moved, are refused") {
  CHECK_FALSE(import_text(""));
  CHECK_FALSE(import_text("hello"));
  CHECK_FALSE(import_text("<xml><nothing/></xml>"));
  CHECK_FALSE(import_calibration("/nowhere/x.cal", cyber_model(), Side::kRight));
  std::string still;
  for (int i = 0; i < 22; ++i) still += "0.0:100.0 -1.0:109.0\n";
  const auto refused = import_text(still);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().line == 1);
  CHECK(refused.error().message.contains("hardly moved"));
  Model other = cyber_model();
  other.driver = "lucidgloves";
  CHECK_FALSE(
      import_calibration(test::scratch_file("r.cal", virtual_hand('R')), other, Side::kRight));
}

TEST_CASE("poses fit a user's glove: sensors that moved are calibrated, others are reported") {
  for (const Side hand : {Side::kRight, Side::kLeft}) {
    const Model model = cyber_model(hand);
    const auto fitted = fit_poses(model, recorded_by(model, cyberglove::kRingPip));
    if (!fitted) FAIL(fitted.error().text());
    for (const char* const moved : {"index_mcp", "little_dip", "thumb_roll", "thumb_abd",
                                    "middle_abd", "ring_abd", "little_abd"}) {
      INFO(moved);
      REQUIRE(fitted->sensors.contains(moved));
      const auto& points = fitted->sensors.at(moved);
      const double slope = (points[1][1] - points[0][1]) / (points[1][0] - points[0][0]);
      // This glove's gains are far from the default's, which count for a pose of few degrees.
      const bool small = std::string_view(moved).ends_with("_abd");
      CHECK(slope == Approx(-1.0 / 50.0).epsilon(small ? 0.6 : 0.06));
    }
    CHECK_FALSE(fitted->sensors.contains("ring_pip"));
    CHECK_FALSE(fitted->sensors.contains("wrist_yaw"));
    REQUIRE(fitted->warnings.size() == 1);
    CHECK(fitted->warnings[0].contains("ring_pip"));
    CalibrationFile file{.driver = "cyberglove",
                         .glove = {},
                         .user = "ann",
                         .hand = hand,
                         .parameters = {},
                         .sensors = fitted->sensors};
    CHECK(make_calibration(model, file, hand, {}));
  }
}

TEST_CASE("poses without a flat hand, or without any movement, fit nothing") {
  const Model model = cyber_model();
  CHECK_FALSE(fit_poses(model, Recorded{}));
  Recorded still = recorded_by(model, 99);
  for (auto& pose : still) pose = still[0];
  const auto nothing = fit_poses(model, still);
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().message.contains("no sensor moved"));
}

// A value that moves several joints is between what each of them asks for.
TEST_CASE("the values of a pose give its angles back, on every glove that sends shares") {
  for (const Driver& driver : registry()) {
    if (driver.glove == nullptr || driver.name == "described") continue;
    for (const std::string type : {"", "ultra-usb-14"}) {
      if (!type.empty() && driver.name != "fivedt") continue;
      const auto options = type.empty()
                               ? driver.expect({})
                               : driver.expect({{"model", type}, {"hand", std::string("right")}});
      const auto model = driver.glove->glove_model(options.value()).value();
      const auto rows = parse_angle_map(model.map_toml, model.driver, model.sensors).value();
      for (std::size_t p = 0; p < kSensorPoses; ++p) {
        const HandAngles hand = hand_in(static_cast<Pose>(p));
        const auto values = values_of(model, hand).value();
        HandAngles made{};
        for (const MapRow& row : rows) {
          made[row.channel] += static_cast<double>(row.gain) * values[row.sensor];
        }
        for (const MapRow& row : rows) {
          if (model.sensors[row.sensor].unit != "1") continue;
          INFO(driver.name << " " << model.sensors[row.sensor].name << " in " << kPoseNames[p]);
          const bool alone = std::ranges::count(rows, row.sensor, &MapRow::sensor) == 1;
          CHECK(made[row.channel] ==
                Approx(hand[row.channel]).margin((alone ? 0.1 : 8.0) * kDegree));
        }
      }
    }
  }
}

}  // namespace posed::drivers::glove
