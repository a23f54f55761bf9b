// For figures that a busy machine can spoil.
#pragma once

#include <utility>

namespace posed::test {

// Runs `scenario` until `good` says yes to what it returned, at most four times, and returns the
// last outcome, which the test judges. A busy machine may hold up any process for a moment, and
// then a frame is late or lost through no fault of the product. What the product does wrong, it
// does each time.
template <typename Scenario, typename Good>
[[nodiscard]] auto asked_again(Scenario&& scenario, Good&& good) {
  auto outcome = scenario();
  for (int i = 0; i < 3 && !good(std::as_const(outcome)); ++i) outcome = scenario();
  return outcome;
}

}  // namespace posed::test
