// P5: reports as libp5glove reads them, the feature reports of a real glove, and the position of
// the hand.
#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>

#include "drivers/p5/decoder.hpp"
#include "drivers/p5/emulator.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/chunk_text.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"

namespace posed::drivers {
namespace {

using p5::CameraRig;
using p5::LedObservation;
using p5::Report;
using p5::RigidPose;
using test::Bytes;
using test::bytes_of_hex;

bool same(const LedObservation& a, const LedObservation& b) {
  return a.led == b.led && a.v2 == b.v2 && a.v1 == b.v1 && a.h == b.h;
}

CameraRig emulated_tower() { return CameraRig::of(p5::emulated_heads(), p5::emulated_leds()); }

// The last feature report of the real dump that begins with `start`.
Bytes dumped(const std::filesystem::path& path, const std::string& start, std::size_t size) {
  std::ifstream file(path);
  Bytes found;
  for (std::string line; std::getline(file, line);) {
    const std::size_t open = line.find("[ " + start + " ");
    const std::size_t close = line.find(']', open == std::string::npos ? 0 : open);
    if (open == std::string::npos || close == std::string::npos) continue;
    const Bytes bytes = bytes_of_hex(line.substr(open + 1, close - open - 1));
    if (bytes.size() == size) found = bytes;
  }
  return found;
}

}  // namespace

TEST_CASE("a P5's report gives bends, buttons and LED observations") {
  const Bytes bytes =
      bytes_of_hex("01 29 47 a8 c8 50 24 81 93 ce 06 40 10 08 03 80 5f ff fc 00 00 00 00 00");
  Report report;
  REQUIRE(bytes.size() == p5::kReportBytes);
  REQUIRE(p5::decode_report(bytes, report) == Outcome::kOk);
  CHECK(report.bend == std::array<std::uint8_t, 5>{50, 10, 20, 30, 40});
  CHECK(report.buttons == 5);
  CHECK(same(report.spot[0], {.led = 0, .v2 = 100, .v1 = -50, .h = 25}));
  CHECK(same(report.spot[1], {.led = 2, .v2 = 1, .v1 = 2, .h = 3}));
  CHECK(same(report.spot[2], {.led = 4, .v2 = -511, .v1 = 511, .h = -1}));
  CHECK(report.spot[3].led == 8);
  const auto again = p5::encode_report(report);
  CHECK(std::ranges::equal(again, bytes));
}

TEST_CASE("a value that wrapped is continued from the one before") {
  CHECK(p5::unwrapped(500, 480) == 500);
  CHECK(p5::unwrapped(-450, 500) == 574);  // 574 = -450 + 1024
  CHECK(p5::unwrapped(450, -500) == -574);
  CHECK(p5::unwrapped(-400, 500) == -400);  // too far from the edge to have wrapped
  CHECK(p5::unwrapped(-450, 574) == 574);
}

TEST_CASE("the position of a LED is recovered, up to the heads' resolution") {
  const CameraRig rig = emulated_tower();
  double worst_m = 0.0;
  for (const double x : {-0.2, 0.0, 0.2}) {
    for (const double y : {-0.1, 0.0, 0.1}) {
      for (const double z : {0.3, 0.5, 0.8}) {
        const Eigen::Vector3d there(x, y, z);
        Eigen::Vector3d found;
        REQUIRE(rig.locate(rig.project(0, there), found));
        worst_m = std::max(worst_m, (found - there).norm());
      }
    }
  }
  CHECK(worst_m < 0.02);  // half a count each of two heads 0.2 m apart, a metre and more away
  Eigen::Vector3d nowhere;
  CHECK_FALSE(rig.locate({.led = 0, .v2 = 500, .v1 = -500, .h = 0}, nowhere));
}

TEST_CASE("three consistent LEDs give the hand's position and rotation, two or false ones do not") {
  const CameraRig rig = emulated_tower();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  const Eigen::Vector3d palm(0.1, -0.05, 0.6);
  std::array<Eigen::Vector3d, p5::kLeds> found{};
  for (std::size_t i = 0; i < p5::kLeds; ++i) found[i] = palm + turn * rig.led_m[i];
  RigidPose place;
  REQUIRE(p5::fit_hand(rig, found, 0b10101, place));
  CHECK((place.position_m - palm).norm() < 1e-9);
  CHECK(place.rotation.angularDistance(turn) < 1e-7);
  CHECK_FALSE(p5::fit_hand(rig, found, 0b00101, place));
  found[3] += Eigen::Vector3d(0.3, 0.0, 0.0);  // a reflection of something else
  REQUIRE(p5::fit_hand(rig, found, 0b11101, place));
  CHECK((place.position_m - palm).norm() < 1e-9);
  CHECK_FALSE(p5::fit_hand(rig, found, 0b01101, place));
}

TEST_CASE("an emulated P5 with its feature reports gives the position of its hand") {
  p5::Settings glove;
  const auto keep = [](const auto& bytes) { return Bytes(bytes.begin(), bytes.end()); };
  glove.firmware = keep(p5::emulated_firmware());
  glove.heads = keep(p5::emulated_heads());
  glove.leds = keep(p5::emulated_leds());
  const Driver& driver = *find_driver("p5");
  const auto description = driver.describe(p5::device_info_of(glove), "x");
  if (!description) FAIL(description.error().text());
  const auto decoder = driver.make_decoder(*description);
  REQUIRE(decoder);
  p5::P5Emulator emulator;
  Bytes bytes;
  emulator.emit(0, bytes);
  test::CollectSink sink;
  const std::uint64_t allocations = test::allocations();
  (*decoder)->feed(bytes, 0, sink);
  CHECK(test::allocations() == allocations);  // the fit takes nothing from the heap
  REQUIRE(sink.samples.size() == 1);
  REQUIRE(sink.frames.size() == 1);
  const Sample& sample = sink.samples[0];
  const auto& names = description->samples.names;
  const auto place = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
  };
  CHECK(sample.value[place("leds")] == 4.0F);
  REQUIRE(sample.valid[place("palm_x")]);
  CHECK(sample.value[place("palm_x")] == Approx(0.05).margin(0.02));
  CHECK(sample.value[place("palm_y")] == Approx(0.02).margin(0.02));
  CHECK(sample.value[place("palm_z")] == Approx(0.5).margin(0.02));
  CHECK(sample.value[place("palm_qw")] > 0.98F);
  CHECK(description->samples.units[place("palm_z")] == "m");
  CHECK(description->samples.units[place("palm_qx")] == "1");
}

TEST_CASE("a P5's device info with a damaged feature report is refused") {
  CHECK(p5::parse_device_info("p5 hand=right firmware=090403 heads=none leds=none", "x"));
  CHECK_FALSE(p5::parse_device_info("p5 hand=right firmware=080403 heads=none leds=none", "x"));
  CHECK_FALSE(p5::parse_device_info("p5 hand=right firmware=0904 heads=none leds=none", "x"));
  CHECK_FALSE(p5::parse_device_info("p5 hand=right firmware=09xx03 heads=none leds=none", "x"));
}

TEST_CASE("a real P5's feature reports give a camera rig of plausible size") {
  const auto dump = test::shared("data/gloves/p5/usb-dump.txt");
  if (!dump) {
    SKIP_WITHOUT_SHARED();
  }
  p5::Settings glove;
  glove.firmware = dumped(*dump, "9", p5::kFirmwareBytes);
  glove.heads = dumped(*dump, "6", p5::kHeadsBytes);
  glove.leds = dumped(*dump, "c", p5::kLedsBytes);
  const auto again = p5::parse_device_info(p5::device_info_of(glove), "x");
  if (!again) FAIL(again.error().text());
  CHECK(glove.firmware == bytes_of_hex("09 04 03"));
  const auto rig = again->rig();
  REQUIRE(rig);
  CHECK(rig->distance_m == Approx(7.9 * 0.0254));
  CHECK(rig->tilt1_rad * 180.0 / std::acos(-1.0) == Approx(17.0 - 19.0 / 32.0));
  CHECK(rig->tilt2_rad * 180.0 / std::acos(-1.0) == Approx(-10.0 - 77.0 / 32.0));
  CHECK(rig->led_m[0].x() == Approx(2.55 * 0.0254));
  CHECK(rig->led_m[0].z() == Approx(1.73 * 0.0254));
  for (const Eigen::Vector3d& led_m : rig->led_m) {
    CHECK(led_m.norm() > 0.02);
    CHECK(led_m.norm() < 0.12);
  }
}

}  // namespace posed::drivers
