// The steps of SCG against a numpy port of NETLAB's implementation (tests/golden/gpr.json).
#include "models/gp/scg.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include "tests/unit/models/gp/golden_gpr.hpp"

#include "models/gp/regression.hpp"

using namespace posed;

namespace {

double rosenbrock(const Eigen::VectorXd& p) {
  return 100.0 * std::pow(p[1] - p[0] * p[0], 2) + std::pow(1.0 - p[0], 2);
}
Eigen::VectorXd rosenbrock_gradient(const Eigen::VectorXd& p) {
  return Eigen::Vector2d{-400.0 * p[0] * (p[1] - p[0] * p[0]) - 2.0 * (1.0 - p[0]),
                         200.0 * (p[1] - p[0] * p[0])};
}

}  // namespace

TEST_CASE("SCG takes the fixture's steps on the evidence of a Gaussian process", "[gp]") {
  const auto golden = test::gpr();
  const auto& expected = golden["scg"];
  gp::ScgOptions options;
  options.max_iterations = 200;
  const auto result =
      gp::maximise_evidence(test::matrix(golden["X"]), test::matrix(golden["Y"]),
                            gp::Hyper::of(test::vector(expected["start"])), 0.0, options);
  REQUIRE(result.trace.size() >= 20);
  for (std::size_t i = 0; i < 20; ++i) {
    INFO("iteration " << i);
    CHECK(result.trace[i].value == Approx(expected["trace_f"][i].get<double>()).epsilon(1e-6));
    // The curvature is a difference quotient: its rounding becomes visible in the scale before it
    // does in f.
    if (i < 15)
      CHECK(result.trace[i].scale ==
            Approx(expected["trace_lambda"][i].get<double>()).epsilon(1e-6));
  }
  CHECK(result.value == Approx(expected["final_f"].get<double>()).epsilon(1e-6));
  CHECK(result.value == Approx(expected["lbfgs_f"].get<double>()).epsilon(1e-6));
}

TEST_CASE("SCG takes the fixture's steps in Rosenbrock's valley", "[gp]") {
  const auto expected = test::gpr()["scg_rosenbrock"];
  gp::ScgOptions options;
  options.max_iterations = 300;
  const auto result =
      gp::scg_minimise(rosenbrock, rosenbrock_gradient, test::vector(expected["start"]), options);
  REQUIRE(result.trace.size() >= 20);
  for (std::size_t i = 0; i < 20; ++i) {
    INFO("iteration " << i);
    CHECK(result.trace[i].value == Approx(expected["trace_f"][i].get<double>()).epsilon(1e-6));
    CHECK(test::relative_error(result.trace[i].x, test::vector(expected["trace_x"][i])) < 1e-6);
  }
  CHECK(result.converged);
  CHECK((result.x - Eigen::Vector2d::Ones()).norm() < 1e-5);
}

TEST_CASE("SCG refuses steps to where the function is not defined", "[gp]") {
  // x - log x: a plain Newton step from 50 jumps far below zero.
  const auto value = [](const Eigen::VectorXd& x) {
    return x[0] > 0.0 ? x[0] - std::log(x[0]) : std::numeric_limits<double>::quiet_NaN();
  };
  const auto gradient = [](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    return Eigen::VectorXd::Constant(1, 1.0 - 1.0 / x[0]);
  };
  const auto result = gp::scg_minimise(value, gradient, Eigen::VectorXd::Constant(1, 50.0));
  CHECK(result.converged);
  CHECK(result.x[0] == Approx(1.0).epsilon(1e-4));
  CHECK(std::any_of(result.trace.begin(), result.trace.end(),
                    [](const gp::ScgStep& step) { return step.comparison < 0.0; }));
}

TEST_CASE("the search ends with the best so far once somebody asks it to stop", "[gp]") {
  const auto value = [](const Eigen::VectorXd& x) { return x.squaredNorm(); };
  const auto gradient = [](const Eigen::VectorXd& x) -> Eigen::VectorXd { return 2.0 * x; };
  int asked = 0;
  gp::ScgOptions options;
  options.stop = [&] { return ++asked > 1; };
  const auto result =
      gp::scg_minimise(value, gradient, Eigen::VectorXd::Constant(3, 50.0), options);
  CHECK(result.trace.size() == 1);
  CHECK_FALSE(result.converged);
  CHECK(result.value == result.trace.front().value);
}
