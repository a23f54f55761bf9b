// The error of the live smoother (models/smooth/README.md, "Measured figures") on a synthetic hand
// and on real grasps with known noise added.
#include <array>
#include <limits>

#include <catch2/catch.hpp>

#include "tests/bench/baselines.hpp"
#include "tests/support/gaps.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/smoothed.hpp"
#include "tests/support/synthetic_hand.hpp"

using namespace posed;
using namespace posed::test;
using smooth::LiveOptions;

namespace {

constexpr double kNotGiven = 0.0;
constexpr std::array kGraspFiles{"10_ex01-rad-003-grasp-su04.txt", "01_ex01-rad-002-grasp-su01.txt",
                                 "04_ex01-rad-045-grasp-su03.txt"};

std::vector<bench::Trial> grasps(const std::filesystem::path& folder, double noise_deg) {
  std::vector<bench::Trial> trials;
  for (const char* name : kGraspFiles) {
    const Motion truth = grasp_reference(folder / name);
    trials.push_back({.truth = truth, .measured = noisy(truth, noise_deg, 11)});
  }
  return trials;
}

// Rms over recordings with equal weights [deg].
double ours(std::span<const bench::Trial> trials, const LiveOptions& options) {
  double sum = 0.0;
  for (const bench::Trial& trial : trials) {
    sum +=
        std::pow(bench::rms_deg(smoothed(trial.measured, trial.rate_hz, options), trial.truth), 2);
  }
  return std::sqrt(sum / static_cast<double>(trials.size()));
}

// The same motion at another rate, interpolated linearly.
Motion at_rate(const Motion& motion, double from_hz, double to_hz) {
  const auto frames = static_cast<Eigen::Index>(
                          std::floor(static_cast<double>(motion.rows() - 1) * to_hz / from_hz)) +
                      1;
  Motion moved(frames, motion.cols());
  for (Eigen::Index t = 0; t < frames; ++t) {
    const double at = static_cast<double>(t) * from_hz / to_hz;
    const auto before = std::min(static_cast<Eigen::Index>(at), motion.rows() - 2);
    const double part = at - static_cast<double>(before);
    moved.row(t) = (1.0 - part) * motion.row(before) + part * motion.row(before + 1);
  }
  return moved;
}

}  // namespace

TEST_CASE("a synthetic hand is followed closely at any noise", "[live]") {
  const SyntheticHand hand = synthetic_hand(18, 123);
  for (const auto& [noise_deg, most_deg] : {std::pair{1.0, 0.56}, {3.0, 1.10}, {6.0, 1.85}}) {
    const Motion measured = noisy(hand.angles, noise_deg, 5);
    const double given =
        bench::rms_deg(smoothed(measured, 30.0, live_options(1, noise_deg)), hand.angles);
    const double found =
        bench::rms_deg(smoothed(measured, 30.0, live_options(1, kNotGiven)), hand.angles);
    CHECK(given <= most_deg);
    if (noise_deg > 1.0) CHECK(found <= 1.05 * most_deg);
  }
}

TEST_CASE("real grasps are followed closer than by any baseline tuned on them", "[live]") {
  const auto folder = shared("data/gloves/graspdb14_cyberglove");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  for (const auto& [noise_deg, most_deg] : {std::pair{1.0, 0.46}, {3.0, 1.25}}) {
    const auto trials = grasps(*folder, noise_deg);
    CHECK(ours(trials, live_options(1, noise_deg)) <= most_deg);
    CHECK(ours(trials, live_options(1, kNotGiven)) <= 1.05 * most_deg);
    for (const int lag : {0, 1, 3}) {
      const double error = ours(trials, live_options(lag, noise_deg));
      for (const bench::Tuned& baseline : bench::tuned_baselines(trials, lag, noise_deg)) {
        INFO(baseline.name << " (" << baseline.setting << ") at lag " << lag);
        CHECK(error < baseline.rms_deg);
      }
    }
  }
}

TEST_CASE("the same grasps at a higher rate are followed no worse", "[live]") {
  const auto folder = shared("data/gloves/graspdb14_cyberglove");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  for (const double noise_deg : {1.0, 3.0}) {
    for (const double lag_s : {0.0, 0.033, 0.067}) {
      double before = std::numeric_limits<double>::infinity();
      for (const double rate_hz : {30.0, 60.0, 120.0, 240.0}) {
        std::vector<bench::Trial> trials;
        for (const char* name : kGraspFiles) {
          const Motion truth = at_rate(grasp_reference(*folder / name), 60.0, rate_hz);
          trials.push_back({truth, noisy(truth, noise_deg, 11), rate_hz});
        }
        LiveOptions options = live_options(0, noise_deg);
        options.lag.seconds = lag_s;
        const double error = ours(trials, options);
        INFO(rate_hz << " Hz, lag " << lag_s << " s");
        CHECK(error <= before);
        before = error;
      }
    }
  }
}

TEST_CASE("dropouts of an unknown hand are bridged no worse than by holding", "[live]") {
  const auto folder = shared("data/gloves/graspdb14_cyberglove");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  for (const double noise_deg : {1.0, 3.0}) {
    const auto trials = grasps(*folder, noise_deg);
    for (const int lag : {0, 1, 3}) {
      GapError error;
      for (const bench::Trial& trial : trials) {
        const Gaps gaps = with_gaps(trial.measured, 8, 3);
        error.add(trial.truth, smoothed(gaps.measured, trial.rate_hz, live_options(lag, noise_deg)),
                  gaps);
      }
      CHECK(error.ours_deg() <= error.held_deg());
    }
  }
}
