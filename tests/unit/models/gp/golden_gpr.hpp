// The Gaussian process fixture, shared by the regression and SCG tests.
#pragma once

#include "tests/support/golden_json.hpp"

namespace posed::test {

inline nlohmann::json gpr() { return golden_json("gpr.json"); }

// Largest difference relative to the largest expected magnitude.
template <typename A, typename B>
double relative_error(const Eigen::MatrixBase<A>& got, const Eigen::MatrixBase<B>& expected) {
  return (got - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

}  // namespace posed::test
