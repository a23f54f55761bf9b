// What the live smoother does with motions that its prior of hands does not expect.
#include <array>
#include <cmath>
#include <numbers>

#include <catch2/catch.hpp>

#include "models/smooth/motion_models.hpp"
#include "tests/bench/baselines.hpp"
#include "tests/support/smoothed.hpp"

namespace posed::smooth {
namespace {

using test::Motion;

Motion four_sines(double frequency_hz, Eigen::Index frames) {
  Motion motion(frames, 4);
  for (Eigen::Index t = 0; t < frames; ++t) {
    for (Eigen::Index c = 0; c < 4; ++c) {
      const double turns =
          frequency_hz * static_cast<double>(t) / 60.0 + 0.25 * static_cast<double>(c);
      motion(t, c) = 30.0 * std::sin(2.0 * std::numbers::pi * turns);
    }
  }
  return motion;
}

TEST_CASE("a sine is smoothed at least as well as by a Kalman filter tuned on it", "[smooth]") {
  const Motion truth = four_sines(1.7, 1500);
  const Motion measured = test::noisy(truth, 1.0, 5);
  double rival_deg = INFINITY;
  for (const double q : {0.2, 0.4, 0.8}) {  // deg^2; the best of them all is 0.4
    const auto made = bench::kalman_velocity(measured, 1, q, 1.0);
    rival_deg = std::min(rival_deg, bench::rms_deg(made, truth));
  }
  const Motion made = test::smoothed(measured, 60.0, test::live_options(1, 0.0));
  CHECK(bench::rms_deg(made, truth) < rival_deg);
}

TEST_CASE("channels at rest, which every model knows exactly, have a mean", "[smooth]") {
  MotionModels models(2);
  const std::array<double, 2> rest_rad{0.3, 0.3};
  const std::array<double, 2> off_rad{0.3 + 1e-12, 0.3};
  const std::array<double, 2> spread_rad2{1e-6, 1e-6};
  for (int t = 0; t < 300; ++t) {
    models.push(1.0 / 60.0, rest_rad, kDegree);
    models.judge(off_rad.data(), spread_rad2.data());
  }
  CHECK(models.mixed(0, 1, 0.3) == Approx(0.3));
}

TEST_CASE("a channel that was missing is the window's for a second", "[smooth]") {
  Motion measured = test::noisy(four_sines(1.7, 1500), 1.0, 5);
  measured.block(1000, 0, 20, 4).setConstant(NAN);
  const Motion made = test::smoothed(measured, 60.0, test::live_options(1, 0.0));
  CHECK(made.allFinite());
  CHECK(made.cwiseAbs().maxCoeff() < 60.0);  // no filter runs on with the speed it had
}

TEST_CASE("a value that is only rounded moves by no more than half a step", "[smooth]") {
  Motion measured = four_sines(0.5, 600);
  measured = (measured.array() / 3.0).round().matrix() * 3.0;
  const Motion made = test::smoothed(measured, 30.0, test::live_options(1, 0.0));
  CHECK((made - measured).bottomRows(500).cwiseAbs().maxCoeff() < 1.501);
}

TEST_CASE("noise beside the rounding keeps the smoother free", "[smooth]") {
  const Motion truth = four_sines(0.5, 600);
  Motion measured = test::noisy(truth, 1.0, 5);
  measured = measured.array().round().matrix().eval();
  const Motion made = test::smoothed(measured, 60.0, test::live_options(1, 0.0));
  CHECK(bench::rms_deg(made, truth) < 0.7 * bench::rms_deg(measured, truth));
}

TEST_CASE("a jump that noise cannot explain is not smeared", "[smooth]") {
  Motion truth = Motion::Zero(300, 4);
  truth.bottomRows(100).setConstant(20.0);
  const Motion measured = test::noisy(truth, 1.0, 5);
  const Motion made = test::smoothed(measured, 30.0, test::live_options(1, 0.0));
  CHECK((made - truth).middleRows(190, 20).cwiseAbs().maxCoeff() < 4.0);
}

}  // namespace
}  // namespace posed::smooth
