// What a speed-adaptive prior alone does badly: slow hands, steady ramps, a glove's dead band, long
// dropouts (models/smooth/README.md, "Steady motion").
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "models/smooth/adaptive_window.hpp"
#include "proto/frame/degree.hpp"
#include "tests/bench/baselines.hpp"
#include "tests/support/smoothed.hpp"
#include "tests/support/synthetic_hand.hpp"

using namespace posed;
using namespace posed::test;

namespace {

constexpr double kSlowRate_hz = 60.0;

// Four channels between 0 and 60 degrees, up and down at a constant speed.
Motion ramps(double speed_deg_s) {
  Motion motion(1800, 4);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    const double way = std::fmod(speed_deg_s * static_cast<double>(t) / kSlowRate_hz, 120.0);
    motion.row(t).setConstant(way < 60.0 ? way : 120.0 - way);
  }
  return motion;
}

// What a glove shows that reports only changes larger than its dead band.
Motion through_dead_band(const Motion& truth, double band_deg) {
  Motion shown = truth;
  for (Eigen::Index t = 1; t < truth.rows(); ++t) {
    for (Eigen::Index c = 0; c < truth.cols(); ++c) {
      if (std::abs(truth(t, c) - shown(t - 1, c)) <= band_deg) shown(t, c) = shown(t - 1, c);
    }
  }
  return shown;
}

// The stage's error over that of the best baseline, which is tuned on this very trial, at lag 1.
double over_best(const bench::Trial& trial, double noise_deg) {
  const Motion made = smoothed(trial.measured, trial.rate_hz, live_options(1, noise_deg));
  double best = std::numeric_limits<double>::infinity();
  for (const bench::Tuned& baseline : bench::tuned_baselines(std::span(&trial, 1), 1, noise_deg)) {
    best = std::min(best, baseline.rms_deg);
  }
  return bench::rms_deg(made, trial.truth) / best;
}

}  // namespace

TEST_CASE("slow steady ramps are followed as well as by the best baseline tuned on them",
          "[live]") {
  for (const auto& [speed_deg_s, noise_deg] : {std::pair{2.0, 3.0},
                                               {5.0, 3.0},
                                               {10.0, 3.0},
                                               {30.0, 3.0},
                                               {120.0, 3.0},
                                               {10.0, 1.0},
                                               {60.0, 1.0}}) {
    const Motion truth = ramps(speed_deg_s);
    INFO(speed_deg_s << " deg/s, noise " << noise_deg << " deg");
    CHECK(over_best({truth, noisy(truth, noise_deg, 11)}, noise_deg) < 1.05);
  }
}

TEST_CASE("jitter of the frames' times does not cost the window its past", "[live]") {
  constexpr int kFrames = 1500;
  for (const double rate_hz : {120.0, 200.0}) {
    std::array<double, 2>
        rough_deg{};  // from frame to frame, at rest: even times, and 1 ms of jitter
    for (const bool jitters : {false, true}) {
      std::mt19937_64 random(5), jitter(6);
      std::normal_distribution<double> normal;
      std::uniform_real_distribution<double> late_s(0.0, 1e-3);
      smooth::AdaptiveWindow window(4);
      std::vector<double> steps_s;  // for their median, as a live stream has it
      double sum = 0.0;
      double before_s = -1.0 / rate_hz;
      std::array<double, 4> last{};
      for (int t = 0; t < kFrames; ++t) {
        const double time_s = t / rate_hz + (jitters ? late_s(jitter) : 0.0);
        steps_s.push_back(time_s - std::exchange(before_s, time_s));
        std::vector<double> recent(
            steps_s.end() - std::min<std::ptrdiff_t>(15, std::ssize(steps_s)), steps_s.end());
        std::ranges::nth_element(recent, recent.begin() + std::ssize(recent) / 2);
        std::array<double, 4> measured_rad{};
        for (double& value : measured_rad) value = kDegree * normal(random);
        window.push(time_s, measured_rad, {.noise_rad = kDegree});
        window.solve(recent[recent.size() / 2]);
        for (std::size_t c = 0; c < 4; ++c) {
          const double step_deg =
              (window.x(0)[c] - std::exchange(last[c], window.x(0)[c])) / kDegree;
          if (t > 2 * kFrames / 3) sum += step_deg * step_deg;
        }
      }
      rough_deg[jitters ? 1 : 0] = std::sqrt(sum);
    }
    INFO(rate_hz << " Hz");
    CHECK(rough_deg[1] < 1.5 * rough_deg[0]);
  }
}

TEST_CASE("nothing pulls on a slow steady ramp", "[live]") {
  const Motion truth = ramps(10.0);  // the first way up takes 6 s
  const Motion made = smoothed(truth, kSlowRate_hz, live_options(0, 3.0));
  CHECK((made - truth).middleRows(120, 220).cwiseAbs().maxCoeff() < 0.05);
}

TEST_CASE("a dead band of 4 deg is smoothed as well as by the best baseline tuned on it",
          "[live]") {
  const Motion truth = synthetic_hand(18, 123).angles;
  std::vector<Eigen::Index> moving;
  for (Eigen::Index c = 0; c < truth.cols(); ++c) {
    if (truth.col(c).maxCoeff() > truth.col(c).minCoeff()) moving.push_back(c);
  }
  const Motion hand = truth(Eigen::all, moving);
  CHECK(over_best({hand, through_dead_band(hand, 4.0), 30.0}, 1.0) < 1.0);
}

TEST_CASE("a dropout longer than the window is left behind", "[live]") {
  const Motion truth = ramps(10.0);
  Motion measured = noisy(truth, 1.0, 13);
  measured.block(120, 1, 50, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  const Motion made = smoothed(measured, kSlowRate_hz, live_options(1, 1.0));
  const auto error = [&](Eigen::Index from, Eigen::Index frames) {
    return (made - truth).block(from, 1, frames, 3).cwiseAbs().maxCoeff();
  };
  CHECK(error(120, 24) < 6.0);  // bridged as long as the window holds a measurement
  CHECK(std::isnan(made(160, 2)));
  CHECK(made.bottomRows(1800 - 170).allFinite());
  CHECK(error(175, 60) < 2.0);
  // The channel that was there throughout is not disturbed.
  CHECK((made - truth).block(120, 0, 100, 1).cwiseAbs().maxCoeff() < 2.0);
}

TEST_CASE("a channel that comes late is not pulled towards zero", "[live]") {
  Motion measured = Motion::Constant(4000, 6, 60.0);
  measured.block(0, 3, 3900, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  const Motion made = smoothed(measured, kSlowRate_hz, live_options(0, 5.0));
  CHECK((made.block(3900, 3, 100, 3).array() - 60.0).abs().maxCoeff() < 0.05);
}
