// Stride frequency and harmonic cycles on signals whose truth is known.
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include "models/style/model/harmonics.hpp"

using namespace posed::style;
using Eigen::VectorXd;

TEST_CASE("The stride is found at any rate and phase", "[stride]") {
  for (const double rate_hz : {30.0, 60.0, 120.0}) {
    for (const double period_s : {0.75, 1.0, 1.6}) {
      const double dtheta = 2.0 * std::numbers::pi / (period_s * rate_hz);
      const VectorXd theta = clip_phase(0.7, dtheta, static_cast<int>(3.3 * rate_hz));
      const VectorXd signal = 0.3 + 0.5 * theta.array().cos() + 0.1 * (2.0 * theta.array()).sin();
      const Stride stride = find_stride(signal, rate_hz);
      CHECK(stride.dtheta == Approx(dtheta).epsilon(0.01));
      CHECK(std::abs(std::remainder(stride.theta0 - 0.7, 2.0 * std::numbers::pi)) < 0.15);
    }
  }
}

TEST_CASE("Two strides are not taken for one", "[stride]") {
  // 0.7 s runs with an uneven second stride: the double period fits slightly better.
  const VectorXd theta = clip_phase(0.0, 2.0 * std::numbers::pi / 21.0, 84);
  const VectorXd signal = theta.array().cos() + 0.08 * (0.5 * theta.array()).sin();
  CHECK(2.0 * std::numbers::pi / find_stride(signal, 30.0).dtheta == Approx(21.0).epsilon(0.02));
}

TEST_CASE("A clip shorter than the shortest stride is refused", "[stride]") {
  CHECK_FALSE(has_stride(18, 30.0));
  CHECK(has_stride(19, 30.0));
}

TEST_CASE("Harmonic regression gives back the cycle and its phase", "[stride]") {
  const VectorXd theta = clip_phase(0.3, 0.21, 64);
  const VectorXd y = 2.0 + 1.5 * (theta.array() - 0.9).cos() + 0.2 * (4.0 * theta.array()).sin();
  const VectorXd grid = cycle_phases(28);
  const VectorXd cycle = harmonic_basis(grid, 4) * fit_harmonics(theta, y, 4);
  const VectorXd want = 2.0 + 1.5 * (grid.array() - 0.9).cos() + 0.2 * (4.0 * grid.array()).sin();
  CHECK((cycle - want).lpNorm<Eigen::Infinity>() < 1e-3);
  CHECK(first_harmonic_phase(theta, y) == Approx(0.9).margin(1e-2));
}
