#include "models/hand/nonnegative.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/support/dice.hpp"

namespace posed::hand {

// The conditions of Karush, Kuhn and Tucker: nothing is below zero, nothing wants to grow, and what
// is above zero wants nothing.
TEST_CASE("a non-negative solution is optimal from any start, also of rows that nearly agree",
          "[nonnegative]") {
  test::Dice dice(11);
  for (int i = 0; i < 500; ++i) {
    const int size = 1 + dice.below(40);
    Eigen::MatrixXd A(size, 45);
    for (auto& a : A.reshaped()) a = dice.within(-1.0, 1.0);
    for (int r = 1; r < size; r += 3) A.row(r) = A.row(r - 1) + 1e-4 * A.row(r);
    SmallMatrix H = A * A.transpose();
    H.diagonal().array() += 1e-10 * H.diagonal().maxCoeff();
    SmallVector c(size), x(size);
    for (int r = 0; r < size; ++r) {
      c[r] = dice.within(-1.0, 1.0);
      x[r] = std::max(0.0, dice.within(-1.0, 1.0));
    }
    REQUIRE(solve_nonnegative(H, c, x));
    const SmallVector slope = c - H * x;
    for (int r = 0; r < size; ++r) {
      INFO("size " << size << " row " << r);
      CHECK(x[r] >= 0.0);
      CHECK(slope[r] <= 1e-6);
      if (x[r] > 0.0) CHECK(std::abs(slope[r]) <= 1e-6);
    }
  }
}

TEST_CASE("a matrix that is not positive is refused and the start stays", "[nonnegative]") {
  SmallMatrix H = SmallMatrix::Zero(2, 2);
  SmallVector c(2), x(2);
  c << 1.0, 1.0;
  x << 0.5, 0.0;
  CHECK_FALSE(solve_nonnegative(H, c, x));
  CHECK(x[0] == 0.5);
}

}  // namespace posed::hand
