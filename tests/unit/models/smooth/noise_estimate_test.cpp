// What the live smoother learns of the sensors while they stream (models/smooth/README.md, "Noise
// estimate").
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <catch2/catch.hpp>

#include "models/smooth/noise_estimate.hpp"
#include "proto/frame/degree.hpp"
#include "tests/bench/baselines.hpp"
#include "tests/bench/smooth_inputs.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/smoothed.hpp"

using namespace posed;
using namespace posed::test;

namespace {

constexpr double kNoiseRate_hz = 60.0;

// Eight channels that rest and swing in turns, and never in step.
Motion swings() {
  Motion motion(1500, 8);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    for (Eigen::Index c = 0; c < motion.cols(); ++c) {
      const double way = std::fmod(static_cast<double>(t + 17 * c) / 90.0, 2.0);
      const double turned = std::clamp(2.0 * way - 1.0, 0.0, 1.0);
      motion(t, c) = 30.0 * (1.0 - std::cos(2.0 * std::numbers::pi * turned));
    }
  }
  return motion;
}

Motion correlated(const Motion& truth, double sd_deg, double correlation) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  Motion measured = truth;
  for (Eigen::Index c = 0; c < truth.cols(); ++c) {
    double now = normal(random);
    for (double& value : measured.col(c)) {
      value += sd_deg * now;
      now = correlation * now + std::sqrt(1.0 - correlation * correlation) * normal(random);
    }
  }
  return measured;
}

// Every sample is shown `times` times.
Motion repeated(Motion measured, Eigen::Index times) {
  for (Eigen::Index t = 0; t < measured.rows(); ++t)
    measured.row(t) = measured.row(t / times * times);
  return measured;
}

struct Learnt {
  double noise_deg, rounding_deg;
  int repeated = 0;               // of the last 600 frames
  std::array<double, 8> own_deg;  // of each channel
};

Learnt learn(const Motion& measured) {
  smooth::NoiseEstimate noise(static_cast<int>(measured.cols()));
  Learnt learnt{};
  const auto before = allocations();
  for (Eigen::Index t = 0; t < measured.rows(); ++t) {
    std::array<double, 8> row{};
    for (std::size_t c = 0; c < row.size(); ++c) {
      row[c] = measured(t, static_cast<Eigen::Index>(c)) * kDegree;
    }
    noise.push(row, t > 0, 1.0 / kNoiseRate_hz);
    if (t >= measured.rows() - 600 && noise.repeated()) ++learnt.repeated;
  }
  CHECK(allocations() == before);
  learnt.noise_deg = noise.noise_rad() / kDegree;
  learnt.rounding_deg = noise.rounding_rad()[0] / kDegree;
  for (std::size_t c = 0; c < learnt.own_deg.size(); ++c) {
    learnt.own_deg[c] = noise.share()[c] * learnt.noise_deg;
  }
  return learnt;
}

}  // namespace

TEST_CASE("white noise is neither correlated nor rounded nor repeated", "[live]") {
  const Learnt learnt = learn(noisy(swings(), 1.0, 3));
  CHECK(learnt.noise_deg == Approx(0.97).epsilon(0.05));
  CHECK(learnt.rounding_deg == 0.0);
  CHECK(learnt.repeated == 0);
}

TEST_CASE("one noisy sensor does not make the others noisy, nor they it quiet", "[live]") {
  Motion measured = noisy(swings(), 0.3, 3);
  measured.col(5) = noisy(swings(), 4.0, 6).col(5);
  const Learnt learnt = learn(measured);
  for (std::size_t c = 0; c < learnt.own_deg.size(); ++c) {
    INFO("channel " << c);
    CHECK(learnt.own_deg[c] == Approx(c == 5 ? 4.0 : 0.3).epsilon(0.3));
  }
  const bench::Trial trial{swings(), measured, kNoiseRate_hz};
  const Motion made = bench::live_stage(trial, 1);
  CHECK(bench::rms_deg(made.col(0), swings().col(0)) < 0.25);
  CHECK(bench::rms_deg(made.col(5), swings().col(5)) < 2.4);
}

TEST_CASE("fingers that drum are no noise", "[live]") {
  Motion truth(900, 8);
  for (Eigen::Index t = 0; t < truth.rows(); ++t) {
    for (Eigen::Index c = 0; c < truth.cols(); ++c) {
      const double turns = 0.2 * static_cast<double>(t) + 0.1 * static_cast<double>(c);
      truth(t, c) = 20.0 * std::sin(2.0 * std::numbers::pi * turns);  // 6 Hz at 30 Hz
    }
  }
  const Motion measured = noisy(truth, 0.3, 3);
  for (const bench::Trial& trial :
       {bench::Trial{truth, measured, 30.0},
        bench::Trial{truth, ((measured / 2.0).array().round() * 2.0).matrix(), 30.0}}) {
    // As far off as the values are: noise alone, and with the rounding.
    const double off_deg = bench::rms_deg(trial.measured, truth);
    CHECK(bench::rms_deg(bench::live_stage(trial, 1).bottomRows(800), truth.bottomRows(800)) <
          1.1 * off_deg);
  }
}

TEST_CASE("correlated noise counts as the white noise that has its power in a motion's band",
          "[live]") {
  // Its third differences alone look like 0.35 deg of white noise.
  const Learnt learnt = learn(correlated(swings(), 1.0, 0.8));
  CHECK(learnt.noise_deg > 0.9);
  CHECK(learnt.noise_deg < 1.7);  // 1.42 of white noise has its power at a 15th of the rate
}

TEST_CASE("steps of quantisation are found, and are no dead band", "[live]") {
  const Learnt learnt = learn(((swings() / 2.0).array().round() * 2.0).matrix());
  CHECK(learnt.rounding_deg == Approx(0.8 * 2.0 / std::sqrt(12.0)).epsilon(0.01));
  CHECK(learnt.repeated == 0);  // a hand that rests is no device that repeats
}

TEST_CASE("a device that shows each sample more than once is told from a hand at rest", "[live]") {
  for (const int times : {2, 3}) {
    const Learnt learnt = learn(repeated(noisy(swings(), 1.0, 3), times));
    CHECK(learnt.repeated == 600 - 600 / times);
    CHECK(learnt.noise_deg == Approx(0.97).epsilon(0.12));
  }
}

TEST_CASE("a channel that shows its own samples more than once measures nothing meanwhile",
          "[live]") {
  Motion measured = noisy(swings(), 1.0, 3);
  for (Eigen::Index t = 1; t < measured.rows(); ++t) {
    for (Eigen::Index c = 0; c < measured.cols(); ++c) {
      if ((t + c) % 2 != 0) measured(t, c) = measured(t - 1, c);
    }
  }
  const Learnt learnt = learn(measured);
  CHECK(learnt.noise_deg == Approx(0.97).epsilon(0.12));
  CHECK(learnt.repeated == 0);  // no frame shows all of them again
  const bench::Trial trial{swings(), measured, kNoiseRate_hz};
  double best_deg = std::numeric_limits<double>::infinity();
  for (const auto& rival : bench::tuned_baselines(std::span(&trial, 1), 1, 1.0)) {
    best_deg = std::min(best_deg, rival.rms_deg);
  }
  CHECK(bench::rms_deg(bench::live_stage(trial, 1), swings()) < best_deg);
}

TEST_CASE("the noise of devices costs hardly more than the best filter that is tuned on it",
          "[live]") {
  const Motion truth = swings();
  for (const Motion& measured : {correlated(truth, 3.0, 0.8), repeated(noisy(truth, 1.0, 3), 2)}) {
    const bench::Trial trial{truth, measured, kNoiseRate_hz};
    double best_deg = std::numeric_limits<double>::infinity();
    for (const auto& rival : bench::tuned_baselines(std::span(&trial, 1), 1, 1.0)) {
      best_deg = std::min(best_deg, rival.rms_deg);
    }
    CHECK(bench::rms_deg(bench::live_stage(trial, 1), truth) < 1.05 * best_deg);
  }
}
