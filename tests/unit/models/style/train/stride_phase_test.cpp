// The phase of walks whose cadence changes, and the score that tells strides from other motion.
#include "models/style/model/stride_phase.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <random>

#include "models/style/model/harmonics.hpp"

using namespace posed::style;
using Eigen::VectorXd;

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kRate_hz = 30.0;

// The phase of a walk whose period swings by `share` about `period_s`, once every 6 s.
VectorXd swinging_phase(int frames, double period_s, double share) {
  VectorXd phase(frames);
  double at = 0.7;
  for (int t = 0; t < frames; ++t) {
    phase[t] = at;
    const double cadence = 1.0 + share * std::sin(kTurn * t / (6.0 * kRate_hz));
    at += kTurn * cadence / (period_s * kRate_hz);
  }
  return phase;
}

VectorXd legs_at(const VectorXd& phase) {
  return 0.1 + 0.5 * phase.array().cos() + 0.08 * (2.0 * phase.array() + 0.4).sin();
}

double phase_error(const VectorXd& found, const VectorXd& truth) {
  double largest = 0.0;
  for (Eigen::Index t = 0; t < truth.size(); ++t) {
    largest = std::max(largest, std::abs(std::remainder(found[t] - truth[t], kTurn)));
  }
  return largest;
}

}  // namespace

TEST_CASE("a constant cadence is followed as exactly as one stride frequency fits it",
          "[stride_phase]") {
  for (const double period_s : {0.7, 1.1, 1.6}) {
    const VectorXd truth = swinging_phase(200, period_s, 0.0);
    const StridePhase found = follow_strides(legs_at(truth), kRate_hz);
    INFO("period " << period_s);
    CHECK(found.dtheta == Approx(kTurn / (period_s * kRate_hz)).epsilon(0.01));
    CHECK(phase_error(found.phase, truth) < 0.25);
    CHECK(found.score < 0.05);
  }
}

TEST_CASE("a cadence that swings by a quarter is followed where one frequency loses it",
          "[stride_phase]") {
  const VectorXd truth = swinging_phase(600, 1.1, 0.25);
  const VectorXd legs = legs_at(truth);
  const StridePhase found = follow_strides(legs, kRate_hz);
  CHECK(find_stride(legs, kRate_hz).score > 0.5);
  CHECK(found.score < 0.1);
  CHECK(phase_error(found.phase, truth) < 0.5);
}

TEST_CASE("however long the legs stand before, after and amid a walk, its strides are the same",
          "[stride_phase]") {
  constexpr Eigen::Index kNear = 5;  // so few frames of standing may be kept
  const VectorXd truth = swinging_phase(300, 1.1, 0.1);
  const VectorXd legs = legs_at(truth);
  for (const Eigen::Index stood : {15, 60, 300}) {
    VectorXd signal(3 * stood + 300);
    signal << VectorXd::Constant(stood, legs[0]), legs.head(150),
        VectorXd::Constant(stood, legs[149]), legs.tail(150), VectorXd::Constant(stood, legs[299]);
    const StridePhase found = follow_strides(signal, kRate_hz);
    INFO("stood " << stood << " frames thrice, score " << found.score);
    CHECK(found.score < 0.1);
    CHECK(found.dtheta == Approx(kTurn / (1.1 * kRate_hz)).epsilon(0.05));
    CHECK(found.strides.size() > 220);
    const auto steps = signal.size() - 1;
    CHECK(((found.phase.tail(steps) - found.phase.head(steps)).array() > 0.0).all());
    double worst = 0.0;
    for (const Eigen::Index t : found.strides) {
      const bool is_first = t < stood + 150 + kNear;
      const Eigen::Index at = t - (is_first ? stood : 2 * stood);
      CHECK(at >= (is_first ? 0 : 150) - kNear);
      CHECK(at < (is_first ? 150 : 300) + kNear);
      if (at < 0 || at >= 300) continue;
      worst = std::max(worst, std::abs(std::remainder(found.phase[t] - truth[at], kTurn)));
    }
    CHECK(worst < 0.3);
  }
}

TEST_CASE("noise and a single jump have no strides", "[stride_phase]") {
  std::mt19937 bits(7);
  std::normal_distribution<double> normal;
  VectorXd noise(300);
  for (double& value : noise) value = normal(bits);
  CHECK(follow_strides(noise, kRate_hz).score > 0.5);
  VectorXd jump = VectorXd::Zero(200);
  for (int t = 0; t < 40; ++t) jump[80 + t] = std::sin(std::numbers::pi * t / 40.0);
  CHECK(follow_strides(jump, kRate_hz).score > 0.5);
}

TEST_CASE("the shortest clip, a constant and 20,000 frames have a phase for every frame",
          "[stride_phase]") {
  for (const int frames : {19, 31, 20'000}) {
    const StridePhase found = follow_strides(legs_at(swinging_phase(frames, 1.1, 0.1)), kRate_hz);
    REQUIRE(found.phase.size() == frames);
    CHECK(found.phase.allFinite());
    CHECK(((found.phase.tail(frames - 1) - found.phase.head(frames - 1)).array() > 0.0).all());
  }
  const StridePhase still = follow_strides(VectorXd::Constant(60, 0.2), kRate_hz);
  CHECK(still.phase.allFinite());
  CHECK(std::isfinite(still.score));
}

TEST_CASE("phases advance even where the legs do nothing", "[stride_phase]") {
  std::mt19937 bits(5);
  std::normal_distribution<double> normal;
  for (const double size : {0.0, 1e-12, 1e-3}) {
    for (int tried = 0; tried < 20; ++tried) {
      VectorXd legs = VectorXd::Constant(30 + 10 * tried, 0.2);
      for (double& value : legs) value += size * normal(bits);
      const StridePhase found = follow_strides(legs, kRate_hz);
      const auto steps = legs.size() - 1;
      INFO("noise " << size << ", frames " << legs.size());
      CHECK(std::isfinite(found.score));
      CHECK(kTurn / found.dtheta < 2.0 * kMaxStride_s * kRate_hz);  // half of the slowest cadence
      CHECK(((found.phase.tail(steps) - found.phase.head(steps)).array() > 0.0).all());
    }
  }
}
