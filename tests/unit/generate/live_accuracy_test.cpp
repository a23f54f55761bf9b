// How far the live generator's hands stay from the truth (hand-science.md 2): the fixture's made-up
// hand, and real grasps with known noise added.
#include <catch2/catch.hpp>

#include "tests/support/made_up_hand.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/smoothed.hpp"

using namespace posed;
using namespace posed::test;
using generate::LiveOptions;

namespace {

LiveOptions with(int lag, double noise_deg) {
  return {.lag = {.frames = lag}, .noise_rad = noise_deg * kDegree};
}

constexpr double kNotGiven = 0.0;

}  // namespace

TEST_CASE("a made-up hand is followed closely at any noise", "[live]") {
  const MadeUpHand hand = made_up_hand(18, 123);
  for (const auto& [noise_deg, most_deg] : {std::pair{1.0, 0.56}, {3.0, 1.10}, {6.0, 1.85}}) {
    const Motion measured = noisy(hand.angles, noise_deg, 5);
    const double given = rms(smoothed(measured, 30.0, with(1, noise_deg)), hand.angles);
    const double found = rms(smoothed(measured, 30.0, with(1, kNotGiven)), hand.angles);
    CHECK(given <= most_deg);
    if (noise_deg > 1.0) CHECK(found <= 1.05 * most_deg);
  }
}
