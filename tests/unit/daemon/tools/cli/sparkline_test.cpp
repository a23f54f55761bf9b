#include "daemon/tools/live/chosen_stream.hpp"

#include <limits>

#include <catch2/catch.hpp>

namespace posed::tools {
namespace {

TEST_CASE("a sparkline has a bar for each value, the largest the tallest", "[sparkline]") {
  CHECK(sparkline({}).empty());
  CHECK(sparkline({0.0, 0.5, 1.0, 2.0, 4.0, 7.0}) == "▁▂▂▃▅█");
  CHECK(sparkline({3e-9}) == "█");
  CHECK(sparkline({0.0, 0.0}) == "▁▁");
}

TEST_CASE("a sparkline stays one of bars, whatever a daemon sends", "[sparkline]") {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  CHECK(sparkline({kNoNumber, -1.0, 1.0, kInfinite}) == "▁▁█▁");
  CHECK(sparkline({-5.0, -1.0}) == "▁▁");
  CHECK(sparkline({1.0, std::numeric_limits<double>::max()}) == "▁█");
}

}  // namespace
}  // namespace posed::tools
