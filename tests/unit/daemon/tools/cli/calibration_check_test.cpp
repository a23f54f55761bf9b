// What `posed calibrate` makes of odd angles, and what it says about the difference from the last
// one.
#include "daemon/tools/devices/calibration_check.hpp"

#include <catch2/catch.hpp>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/possible_angles.hpp"
#include "proto/frame/degree.hpp"

namespace posed::tools {

TEST_CASE("a calibration that no hand can have, or that differs from the last, is told") {
  using namespace drivers::glove;
  const Model model = drivers::cyberglove::glove_model(Side::kRight).value();
  // The value of this angle.
  const auto value = [&](double deg) {
    HandAngles hand{};
    hand[kFingerChannels] = deg * kDegree;
    const auto values = values_of(model, hand).value();
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (model.sensors[i].name == "index_mcp") return values[i];
    }
    return 0.0;
  };
  CalibrationFile file{.driver = "cyberglove",
                       .glove = {},
                       .user = "ann",
                       .hand = Side::kRight,
                       .parameters = {},
                       .sensors = {{"index_mcp", {{50.0, 0.0}, {150.0, value(80.0)}}}}};
  const auto calibration = [&] { return make_calibration(model, file, Side::kRight, "").value(); };
  Recorded recorded{};
  for (std::size_t i = 0; i < model.sensors.size(); ++i) {
    if (model.sensors[i].name != "index_mcp") continue;
    recorded[0][i].add(50.0F);
    recorded[1][i].add(150.0F);
  }
  const auto last = calibration();
  CHECK(drivers::glove::keep_possible(model, recorded, Side::kRight, file).value().empty());
  CHECK(differences(model, *last, *last, recorded).sentences ==
        std::vector<std::string>{
            "no joint differs by more than 0 degrees from the last calibration"});
  file.sensors["index_mcp"][1][1] = value(94.0);
  CHECK(differences(model, *last, *calibration(), recorded).sentences ==
        std::vector<std::string>{"index MCP differs by 14 degrees from the last calibration"});
  CHECK(differences(model, *last, *calibration(), recorded).mostly_unlike());
  file.sensors["index_mcp"][1][1] = value(86.0);  // what a glove put on again may differ by
  CHECK_FALSE(differences(model, *last, *calibration(), recorded).mostly_unlike());
  file.sensors["index_mcp"][1][1] = value(170.0);
  const auto odd = drivers::glove::keep_possible(model, recorded, Side::kRight, file).value();
  REQUIRE(odd.size() == 1);
  CHECK(
      odd[0].starts_with("index MCP would be at 170 degrees in the pose fist, which no hand "
                         "can do: it stops at 110"));
  const auto angle_deg = [&](float raw) {
    std::array<Held, kMaxSensors> held = recorded[0];
    for (auto& sensor : held) {
      if (sensor.count == 0) continue;
      sensor = {};
      sensor.add(raw);
    }
    return angles_of(model, *calibration(), held)[kFingerChannels] / kDegree;
  };
  CHECK(angle_deg(100.0F) == Approx(85.0).margin(0.5));  // up to there as it was fitted
  CHECK(angle_deg(150.0F) == Approx(110.0).margin(0.5));
  CHECK(angle_deg(250.0F) == Approx(110.0).margin(0.5));
}

}  // namespace posed::tools
