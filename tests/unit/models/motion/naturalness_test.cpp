#include "models/motion/naturalness.hpp"

#include <catch2/catch.hpp>

#include <cmath>

#include "tests/support/golden_json.hpp"

namespace posed::motion {
namespace {

// A channel that oscillates, with a ripple on it.
Rows swinging(int frames, double ripple, double phase = 0.0) {
  Rows rows(frames, 3);
  for (int i = 0; i < frames; ++i) {
    for (int c = 0; c < 3; ++c) {
      rows(i, c) = std::sin(0.05 * i * (c + 1) + phase) + ripple * std::sin(1.9 * i + c);
    }
  }
  return rows;
}

}  // namespace

TEST_CASE("smoothness of speed profiles agrees with the fixture") {
  const auto geom = test::golden_json("geom.json");
  const double rate_hz = geom["sparc_params"]["fs"].get<double>();
  REQUIRE(geom["metrics"].size() == 3);
  for (const auto& [name, one] : geom["metrics"].items()) {
    INFO(name);
    const auto speed = one["speed"].get<std::vector<double>>();
    CHECK(spectral_arc_length(speed, rate_hz) == Approx(one["sparc"].get<double>()).epsilon(1e-6));
    CHECK(log_dimensionless_jerk(speed, rate_hz) ==
          Approx(one["ldlj"].get<double>()).epsilon(1e-6));
  }
}

TEST_CASE("the Frechet distance agrees with the fixture and is zero to itself") {
  const auto one = test::golden_json("geom.json")["frechet"];
  const Gaussian a{test::vector(one["m1"]), test::matrix(one["S1"])};
  const Gaussian b{test::vector(one["m2"]), test::matrix(one["S2"])};
  CHECK(frechet_distance(a, b) == Approx(one["value"].get<double>()).epsilon(1e-6));
  CHECK(frechet_distance(b, a) == Approx(one["value"].get<double>()).epsilon(1e-6));
  CHECK(frechet_distance(a, a) == Approx(0.0).margin(1e-9));
}

TEST_CASE("a cubic has no more jerk than its third difference, a short motion none") {
  Rows cubic(20, 2);
  for (int i = 0; i < 20; ++i) cubic.row(i).setConstant(i * i * i);
  CHECK(jerk_rms(cubic) == Approx(6.0));
  CHECK(jerk_rms(cubic.topRows(3)) == 0.0);
  CHECK(jerk_rms(swinging(200, 0.05)) > 3 * jerk_rms(swinging(200, 0.0)));
  CHECK(speed_of(cubic, 30.0).size() == 19);
  CHECK(speed_of(cubic, 30.0)[0] == Approx(30.0 * std::sqrt(2.0)));
}

TEST_CASE("speeds that are constant or too short give NaN") {
  const std::vector<double> still(50, 0.0);
  CHECK(std::isnan(log_dimensionless_jerk(still, 60)));
  CHECK(std::isnan(spectral_arc_length(still, 60)));
  CHECK(std::isnan(spectral_arc_length({}, 60)));
  CHECK(std::isnan(log_dimensionless_jerk(std::vector<double>{1, 2}, 60)));
}

TEST_CASE("a motion is nearer to a similar one than to another") {
  const Rows one = swinging(600, 0.0);
  const double like = motion_distance(one, swinging(600, 0.0, 0.4)).value();
  CHECK(motion_distance(one, one).value() == Approx(0.0).margin(1e-9));
  CHECK(motion_distance(one, swinging(600, 0.3)).value() > 2 * like);
  CHECK(motion_distance(one, Rows(one.array() + 1.0)).value() > 2 * like);
  CHECK(motion_distance(one.topRows(40), one).error().message ==
        "the motions are too short for a distance of their features: at least 50 frames are "
        "needed");
  CHECK_FALSE(motion_distance(one, one.leftCols(2)));
}

}  // namespace posed::motion
