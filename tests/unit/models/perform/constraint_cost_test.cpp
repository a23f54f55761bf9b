// What the constraints cost on everything that a model of real poses can perform in four labels.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include <catch2/catch.hpp>

#include "models/gesture/train.hpp"
#include "models/hand/constraint_solver.hpp"
#include "models/perform/perform.hpp"
#include "tests/support/processor_time.hpp"
#include "tests/support/real_pose_corpus.hpp"
#include "tests/support/shared.hpp"

namespace posed::perform {
namespace {

// Every sequence of four of these labels.
std::vector<std::vector<int>> strings_of_four(const std::vector<int>& labels) {
  std::vector<std::vector<int>> strings;
  for (const int a : labels) {
    for (const int b : labels) {
      for (const int c : labels) {
        for (const int d : labels) strings.push_back({a, b, c, d});
      }
    }
  }
  return strings;
}

}  // namespace

TEST_CASE("the processor time of the constraints on all strings of four labels", "[.bench]") {
  const auto poses = test::shared("data/gloves/libras_cyberglove");
  if (!poses) SKIP_WITHOUT_SHARED();
  const auto model = gesture::train_gesture({test::real_pose_corpus(*poses, 7)}, {});
  REQUIRE(model);
  const trajectory::StateInformation information(
      std::make_shared<const gesture::GestureModel>(*model), model->rate_hz);
  std::vector<double> us;
  double smallest_m = 1.0;
  for (const auto& string : strings_of_four(labels_of(*model, "g c p 1 3 4").value())) {
    Performance performance = perform(information, string, {}).value();
    hand::ConstraintSolver solver;
    for (std::size_t t = 0; t < performance.angles.size(); ++t) {
      HandAngles pose = hand_of(performance.angles[t]);
      const HandAngles variance = hand_of(performance.variances[t]);
      const double begin_us = test::processor_time_us();
      const auto report = solver.step(pose, variance);
      us.push_back(test::processor_time_us() - begin_us);
      smallest_m = std::min(smallest_m, report.min_gap_m);
    }
  }
  std::printf("%s; gap at least %.4f mm\n", test::time_figures(us).c_str(), 1e3 * smallest_m);
  CHECK(smallest_m >= 0.2e-3 - 1e-9);
}

}  // namespace posed::perform
