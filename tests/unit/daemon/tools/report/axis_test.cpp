// Axes: round ticks, and values that have no place.
#include "daemon/tools/report/plot.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <random>

namespace posed::report {
namespace {

Range range_over(double low, double high) {
  Range range;
  range.add(low);
  range.add(high);
  return range;
}

std::vector<std::string> tick_texts(const Axis& axis, int most) {
  std::vector<std::string> texts;
  for (const Tick& tick : axis.ticks(most)) texts.push_back(tick.text);
  return texts;
}

}  // namespace

TEST_CASE("ticks of an axis are round and within it", "[report]") {
  CHECK(tick_texts(Axis("a", "s", range_over(0.0, 10.0)), 6) ==
        std::vector<std::string>{"0", "2", "4", "6", "8", "10"});
  CHECK(tick_texts(Axis("a", "s", range_over(-0.13, 0.31)), 6) ==
        std::vector<std::string>{"-0.1", "0", "0.1", "0.2", "0.3"});
  CHECK(Axis("time", "s", range_over(0.0, 1.0)).label() == "time [s]");

  std::mt19937 random(11);
  std::uniform_real_distribution<double> exponent(-9.0, 9.0);
  std::uniform_real_distribution<double> place(-3.0, 3.0);
  for (int i = 0; i < 500; ++i) {
    const double extent = std::pow(10.0, exponent(random));
    const double low = place(random) * extent;
    const Axis axis("a", "1", range_over(low, low + extent));
    const auto ticks = axis.ticks(8);
    CAPTURE(low, extent);
    REQUIRE(ticks.size() >= 2);
    REQUIRE(ticks.size() <= 9);
    for (const Tick& tick : ticks) {
      REQUIRE(tick.value >= low - 1e-6 * extent);
      REQUIRE(tick.value <= low + extent * (1.0 + 1e-6));
    }
  }
}

TEST_CASE("a logarithmic axis ends at powers of ten and has no place for zero", "[report]") {
  Axis axis = Axis::logarithmic("age", "us", range_over(30.0, 2500.0));
  axis.place(0.0, 300.0);
  CHECK(axis.low() == Approx(10.0));
  CHECK(axis.high() == Approx(10'000.0));
  CHECK(axis.px(100.0) == Approx(100.0));
  CHECK(tick_texts(axis, 9) ==
        std::vector<std::string>{"10", "30", "100", "300", "1000", "3000", "10000"});
  CHECK_FALSE(axis.shows(0.0));
  CHECK_FALSE(axis.shows(-1.0));
}

TEST_CASE("an axis over nothing, one value or broken values still has two ends", "[report]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Range broken;
  broken.add(nan);
  broken.add(std::numeric_limits<double>::infinity());
  CHECK(broken.empty);
  for (const Range& range : {Range(), broken, range_over(0.0, 0.0), range_over(-7.0, -7.0),
                             range_over(1e-300, 1e-300)}) {
    for (Axis axis : {Axis("a", "1", range), Axis::logarithmic("a", "1", range)}) {
      axis.place(10.0, 20.0);
      REQUIRE(axis.low() < axis.high());
      for (const Tick& tick : axis.ticks(5)) CHECK(std::isfinite(axis.px(tick.value)));
      CHECK_FALSE(axis.shows(nan));
      CHECK(axis.px(1e300) == Approx(20.0));
    }
  }
}

TEST_CASE("two axes of one unit get one scale", "[report]") {
  Axis x("a", "deg", range_over(0.0, 10.0));
  Axis y("b", "deg", range_over(0.0, 1.0));
  equal_scales(x, 100.0, y, 50.0);
  CHECK(x.high() - x.low() == Approx(10.0));
  CHECK(y.high() - y.low() == Approx(5.0));
  CHECK(0.5 * (y.low() + y.high()) == Approx(0.5));
}

}  // namespace posed::report
