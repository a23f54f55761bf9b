// The screen of `posed calibrate`, tested as text.
#include "daemon/tools/devices/calibrate_poses.hpp"

#include <catch2/catch.hpp>

namespace posed::tools {
namespace {

using drivers::glove::Pose;

CalibrateView view_of(int sensors) {
  CalibrateView view{.title = "posed calibrate: cyberglove, right hand of ann",
                     .poses = {Pose::kFlat, Pose::kFist, Pose::kThumb, Pose::kSpread}};
  for (int i = 0; i < sensors; ++i) {
    view.sensors.push_back({.name = "middle_joint" + std::to_string(i),
                            .there = true,
                            .value = 128.0,
                            .low = 64.0,
                            .high = 192.0});
  }
  return view;
}

std::string all(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace

TEST_CASE("the calibration's screen fits every terminal") {
  for (const int sensors : {0, 1, 5, 22, 32}) {
    for (const int width : {40, 60, 80, 200}) {
      for (const int height : {6, 10, 24, 60}) {
        for (const PosePhase phase : {PosePhase::kAsked, PosePhase::kHeld}) {
          CalibrateView view = view_of(sensors);
          view.title += std::string(200, 'x');
          view.note = std::string(200, 'y');
          view.width = width;
          view.height = height;
          view.phase = phase;
          view.left_s = 1.0;
          view.any_held = true;
          const auto lines = calibrate_view(view);
          CHECK(lines.size() <= static_cast<std::size_t>(height));
          for (const std::string& line : lines) {
            INFO(sensors << " sensors, " << width << " x " << height << ": " << line);
            CHECK(line.size() <= static_cast<std::size_t>(width));
            CHECK_FALSE(line.contains('\x1b'));
          }
        }
      }
    }
  }
}

TEST_CASE("all sensors of a glove have a bar on 80 x 24 and 60 x 24") {
  for (const int width : {60, 80}) {
    CalibrateView view = view_of(23);
    view.width = width;
    const std::string text = all(calibrate_view(view));
    INFO(text);
    CHECK(std::ranges::count(text, '|') == 2 * 23);
    CHECK(text.contains("##"));
  }
}

TEST_CASE("sensors remain distinguishable when their names are cut") {
  CalibrateView view = view_of(3);
  view.width = 40;
  view.height = 12;
  for (SensorView& sensor : view.sensors) sensor.name = "a_very_long_finger_" + sensor.name;
  const std::string text = all(calibrate_view(view));
  INFO(text);
  for (const char* end : {"~t0 |#", "~t1 |#", "~t2 |#"}) CHECK(text.contains(end));
}

TEST_CASE("sensors that do not fit on the screen are counted") {
  CalibrateView view = view_of(32);
  view.width = 40;
  view.height = 16;
  const std::string text = all(calibrate_view(view));
  INFO(text);
  const auto bars = std::ranges::count(text, '|') / 2;
  CHECK(text.contains("... and " + std::to_string(32 - bars) + " more: make the window larger"));
}

TEST_CASE("of many poses the screen shows the current one and those after it") {
  CalibrateView view = view_of(2);
  view.poses = PosePlan{}.poses();
  view.pose = 8;
  view.may_skip = true;
  const std::string text = all(calibrate_view(view));
  INFO(text);
  CHECK(text.contains("\n[touch-fist]   flat-again   spread-again\n"));
  CHECK(text.contains("s: skip the rest"));
}

TEST_CASE("the screen shows which pose to take and what to do") {
  CalibrateView view = view_of(2);
  std::string text = all(calibrate_view(view));
  CHECK(text.contains("[flat]   fist   thumb   spread\n"));
  CHECK(text.contains("Lay the hand flat on the table"));
  CHECK(text.contains("Enter: I hold it   q: give up\n"));
  view.pose = 1;
  text = all(calibrate_view(view));
  CHECK(text.contains("flat: done   [fist]   thumb   spread\n"));
  CHECK(text.contains("b: back"));
  CHECK_FALSE(text.contains("s: skip the rest"));
  view.left_s = 1.5;
  view.share = 0.5;
  CHECK(all(calibrate_view(view)).contains("Get ready  [==========          ] 1.5 s\n"));
  view.phase = PosePhase::kHeld;
  CHECK(all(calibrate_view(view)).contains("Hold still [==========          ] 1.5 s\n"));
  view.silent = true;
  CHECK(all(calibrate_view(view)).contains("Nothing comes from the glove"));
}

TEST_CASE("a bar shows the current value and the range seen so far") {
  SensorView sensor{.name = "index", .least = 0, .most = 100, .there = true, .value = 30};
  sensor.low = 10;
  sensor.high = 60;
  CHECK(sensor_bar(sensor, 10) == "###---    ");
  sensor.value = 60;
  CHECK(sensor_bar(sensor, 10) == "######    ");
  sensor.value = 1e9;
  CHECK(sensor_bar(sensor, 10) == "##########");
  sensor.value = -5;
  CHECK(sensor_bar(sensor, 10) == " -----    ");
  sensor.most = sensor.least;  // as if a driver had a mistake
  CHECK(sensor_bar(sensor, 10).size() == 10);
  CHECK(sensor_bar(sensor, 0).empty());
}

TEST_CASE("a sensor that has not moved is marked after a pose; one never measured is left out") {
  CalibrateView view = view_of(3);
  view.sensors[1].low = view.sensors[1].high = 128;
  view.sensors[2].there = false;
  CHECK_FALSE(all(calibrate_view(view)).contains('!'));
  view.any_held = true;
  const std::string text = all(calibrate_view(view));
  CHECK(text.contains("   128 !\n"));
  CHECK(text.contains("! has not moved yet"));
  CHECK_FALSE(text.contains("middle_joint2"));
  view.colour = true;
  CHECK(all(calibrate_view(view)).contains("\x1b[33mmiddle_joint1"));
}

}  // namespace posed::tools
