// Trajectories from information rows against the numpy fixture (tests/golden/mlpg.json), within
// 1e-8.

#include <catch2/catch.hpp>

#include "models/trajectory/fixed_lag.hpp"
#include "models/trajectory/sliding_window.hpp"
#include "tests/support/allocations.hpp"
#include "tests/unit/models/trajectory/golden_mlpg.hpp"

using namespace posed;
using test::off;
using test::Table;
using trajectory::Boundary;

namespace {

constexpr double kExact = 1e-8;  // the fixture's tolerance

double worst_of(const trajectory::SlidingWindow& window, const nlohmann::json& expected) {
  const auto table = expected.get<Table>();
  double worst = 0.0;
  for (std::size_t t = 0; t < table.size(); ++t) {
    worst = std::max(worst, off(window.x(static_cast<int>(t)), table[t]));
  }
  return worst;
}

}  // namespace

TEST_CASE("a whole sequence is solved under all boundary rules", "[generate]") {
  const auto golden = test::golden_json("mlpg.json");
  const auto information = test::information_of(golden, false);
  const auto frames = test::frames_of(information);
  trajectory::SlidingWindow window(information.channels(), information.frames());
  window.solve(frames);
  CHECK(worst_of(window, golden["x_drop"]) < kExact);
  const auto expected = golden["posterior_var_drop"].get<Table>();
  trajectory::InformationForm row(information.channels(), 1);
  for (int t = 0; t < information.frames(); ++t) {
    window.variance(t, row.row(0, trajectory::kPosition));
    CHECK(off(row.frame(0), expected[static_cast<std::size_t>(t)]) < kExact);
  }
  window.solve(frames, Boundary::kZero);
  CHECK(worst_of(window, golden["x_zero"]) < kExact);
  window.solve(frames, Boundary::kHold);
  CHECK(worst_of(window, golden["x_hold"]) < kExact);
}

TEST_CASE("observations with a dropout are information like any other", "[generate]") {
  const auto golden = test::golden_json("mlpg.json");
  const auto information = test::information_of(golden, true);
  trajectory::SlidingWindow window(information.channels(), information.frames());
  window.solve(test::frames_of(information));
  CHECK(worst_of(window, golden["x_obs"]) < kExact);
}

TEST_CASE("sequences of one and two frames are solved", "[generate]") {
  trajectory::InformationForm information(1, 2);
  for (int t = 0; t < 2; ++t) {
    information.row(t, trajectory::kPosition)[0] = 4.0;
    information.row(t, trajectory::kPositionMean)[0] = 4.0 * (t + 1);
    information.row(t, trajectory::kDeltaDelta)[0] = 1.0;
  }
  const auto frames = test::frames_of(information);
  trajectory::SlidingWindow window(1, 2);
  window.solve(std::span(frames).first(1));
  CHECK(window.x(0)[0] == Approx(1.0));
  window.solve(std::span(frames).first(1), Boundary::kHold);
  CHECK(window.x(0)[0] == Approx(1.0));
  window.solve(std::span(frames).first(1), Boundary::kZero);
  CHECK(window.x(0)[0] == Approx(0.5));  // 4 / (4 + 2^2)
  window.solve(frames);
  CHECK(window.x(1)[0] == Approx(2.0));
  // Held edges: both delta-deltas are +-(x1 - x0) = 0 with precision 1 each.
  window.solve(frames, Boundary::kHold);
  CHECK(window.x(0)[0] + window.x(1)[0] == Approx(3.0));
  CHECK(window.x(1)[0] - window.x(0)[0] == Approx(0.5));
}

TEST_CASE("the fixed-lag form gives what a solve of all frames so far would", "[generate]") {
  const auto golden = test::golden_json("mlpg.json");
  for (const bool observed : {false, true}) {
    const auto information = test::information_of(golden, observed);
    const int last = information.frames() - 1;
    trajectory::InformationForm out(information.channels(), 1);
    double* x = out.row(0, trajectory::kPosition);
    for (const auto& [name, table] : golden[observed ? "fixed_lag_obs" : "fixed_lag"].items()) {
      const auto expected = table.get<Table>();
      trajectory::FixedLag stream(information.channels(), std::stoi(name));
      const std::uint64_t before = test::allocations();
      double worst = 0.0;
      for (int t = 0; t <= last; ++t) {
        stream.push(information.frame(t));
        for (int back = stream.lag(); back >= (t == last ? 0 : stream.lag()); --back) {
          if (back > t) continue;
          stream.estimate(back, x, nullptr);
          worst = std::max(worst, off(x, expected[static_cast<std::size_t>(t - back)]));
        }
      }
      CHECK(test::allocations() == before);
      INFO("lag " << name << ", observed " << observed);
      CHECK(worst < kExact);
    }
  }
}

TEST_CASE("the fixed-lag variance is that of the frames so far", "[generate]") {
  const auto golden = test::golden_json("mlpg.json");
  const auto information = test::information_of(golden, true);
  const auto frames = test::frames_of(information);
  trajectory::SlidingWindow window(information.channels(), information.frames());
  trajectory::FixedLag stream(information.channels(), 4);
  trajectory::InformationForm rows(information.channels(), 1);
  double* x = rows.row(0, trajectory::kPosition);
  double* got = rows.row(0, trajectory::kPositionMean);
  double* expected = rows.row(0, trajectory::kDelta);
  for (int t = 0; t < information.frames(); ++t) {
    stream.push(information.frame(t));
    if (t < stream.lag()) continue;
    stream.estimate(stream.lag(), x, got);
    window.solve(std::span(frames).first(static_cast<std::size_t>(t) + 1));
    window.variance(t - stream.lag(), expected);
    for (int c = 0; c < information.channels(); ++c) CHECK(got[c] == Approx(expected[c]));
  }
}

TEST_CASE("a solve does not allocate, and every vector width gives the same", "[generate]") {
  const auto golden = test::golden_json("mlpg.json");
  const auto narrow = test::information_of(golden, true);
  trajectory::InformationForm wide(66, narrow.frames());
  for (int t = 0; t < wide.frames(); ++t) {
    for (int r = 0; r < trajectory::kRows; ++r) {
      const auto row = static_cast<trajectory::Row>(r);
      for (int c = 0; c < 66; ++c) wide.row(t, row)[c] = narrow.row(t, row)[c % narrow.channels()];
    }
  }
  const auto frames = test::frames_of(wide);
  trajectory::SlidingWindow window(wide.channels(), wide.frames());
  const std::uint64_t before = test::allocations();
  window.solve(frames);
  CHECK(test::allocations() == before);
  for (int t = 0; t < wide.frames(); ++t) {
    for (int c = 3; c < 66; ++c) CHECK(window.x(t)[c] == window.x(t)[c % 3]);
  }
}
