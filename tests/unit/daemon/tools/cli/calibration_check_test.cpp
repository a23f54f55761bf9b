// What `posed calibrate` says about a calibration: odd angles, and the difference from the last
// one.
#include "daemon/tools/devices/calibration_check.hpp"

#include <catch2/catch.hpp>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/glove/calibration_file.hpp"
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
  CHECK(impossible_angles(model, *last, recorded).empty());
  CHECK(differences(model, *last, *last, recorded) ==
        std::vector<std::string>{
            "no joint differs by more than 0 degrees from the last calibration"});
  file.sensors["index_mcp"][1][1] = value(94.0);
  CHECK(differences(model, *last, *calibration(), recorded) ==
        std::vector<std::string>{"index MCP differs by 14 degrees from the last calibration"});
  file.sensors["index_mcp"][1][1] = value(170.0);
  const auto odd = impossible_angles(model, *calibration(), recorded);
  REQUIRE(odd.size() == 1);
  CHECK(odd[0].starts_with("index MCP would be at 170 degrees in the pose fist"));
}

}  // namespace posed::tools
