// min 1/2 x' H x - c' x subject to x >= 0, for a small positive definite H: active sets as in
// Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23, from a given start.
#pragma once

#include <Eigen/Core>

#include "proto/frame/rt_safe.hpp"

namespace posed::hand {

inline constexpr int kMaxUnknowns = 40;
using SmallMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxUnknowns, kMaxUnknowns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxUnknowns>;

// `x` is the start, none of it below zero, and becomes the solution. False: H is not positive
// definite, or the sets did not settle; `x` is then no worse than the start.
RT_SAFE [[nodiscard]] bool solve_nonnegative(const SmallMatrix& H, const SmallVector& c,
                                             SmallVector& x) noexcept;

}  // namespace posed::hand
