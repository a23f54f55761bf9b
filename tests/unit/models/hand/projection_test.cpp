#include "models/hand/projection.hpp"

#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

#include "tests/support/dice.hpp"

namespace posed::hand {
namespace {

struct Problem {
  HandAngles target{}, keeps{}, variance{}, low{}, high{};
  std::vector<Row> rows;

  // Rows of two fingers each; a pose within the box keeps them all, unless they contradict it.
  Problem(test::Dice& dice, bool contradicts) {
    for (std::size_t c = 0; c < target.size(); ++c) {
      target[c] = dice.within(-1.0, 1.0);
      keeps[c] = dice.within(-0.9, 0.9);
      variance[c] = std::pow(10.0, dice.within(-3.0, 0.0));
      low[c] = -1.0;
      high[c] = 1.0;
    }
    for (int r = 1 + dice.below(12); r > 0; --r) {
      Row row{.pair = r, .finger_a = dice.below(2), .finger_b = 2 + dice.below(3), .slope = {}};
      for (double& slope : row.slope.a) slope = dice.within(-0.08, 0.08);
      for (double& slope : row.slope.b) slope = dice.within(-0.08, 0.08);
      row.least = contradicts ? 10.0 : -dice.within(0.0, 0.02);
      for (std::size_t i = 0; i < kFingerChannels && !contradicts; ++i) {
        row.least +=
            row.slope.a[i] * keeps[kFingerChannels * static_cast<std::size_t>(row.finger_a) + i] +
            row.slope.b[i] * keeps[kFingerChannels * static_cast<std::size_t>(row.finger_b) + i];
      }
      rows.push_back(row);
    }
  }
  HandAngles solved(Forces& forces) const {
    const Box box{low, high};
    return project(target, variance, rows, &box, forces);
  }
};

}  // namespace

TEST_CASE("rows that contradict the limits leave no force behind", "[projection]") {
  test::Dice dice(5);
  for (int i = 0; i < 300; ++i) {
    Forces warm{};
    const Problem impossible(dice, true);
    const HandAngles torn = impossible.solved(warm);
    for (std::size_t c = 0; c < torn.size(); ++c) {
      REQUIRE(torn[c] >= impossible.low[c]);
      REQUIRE(torn[c] <= impossible.high[c]);
    }
    const Problem possible(dice, false);
    Forces cold{};
    const HandAngles expected = possible.solved(cold);
    const HandAngles pose = possible.solved(warm);
    for (std::size_t c = 0; c < pose.size(); ++c) {
      INFO("problem " << i << " angle " << c);
      CHECK(pose[c] == Approx(expected[c]).margin(1e-5));
    }
  }
}

TEST_CASE("forces far too large at the limits come back", "[projection]") {
  test::Dice dice(6);
  for (int i = 0; i < 300; ++i) {
    const Problem problem(dice, false);
    Forces cold{}, warm{};
    const HandAngles expected = problem.solved(cold);
    warm.fill(1e300);
    const HandAngles pose = problem.solved(warm);
    for (std::size_t c = 0; c < pose.size(); ++c) {
      INFO("problem " << i << " angle " << c);
      CHECK(pose[c] == Approx(expected[c]).margin(1e-5));
    }
  }
}

}  // namespace posed::hand
