// The matrices of the predictor's confidence, computed once when a model is loaded. Cold.
//
// g(q) = 1 - v(q) / e^lambda with v the posterior variance of the RBF part (README.md,
// "Confidence"). With k^ = k / e^lambda and s = noise / e^lambda, g = k^' M k^ = |L k^|^2 for a
// lower triangle L:
//
//   up to 256 poses  exact:  M = (K^ + s I)^-1
//   above            m = 128 inducing poses by greedy pivoted Cholesky, more (up to 256) where 128
//                    explain the training poses badly: M = K_mm^-1 - (K_mm + K_mn K_nm / s)^-1,
//                    near the exact one (confidence.cpp says how near)
#pragma once

#include <vector>

#include "models/gp/trained.hpp"

namespace posed::gp {

struct Confidence {
  std::vector<int> order;       // of the training poses: those that the triangle uses come first
  int rows = 0;                 // of the triangle, a multiple of 16
  std::vector<float> triangle;  // blocks as drawn in kernel.hpp
};

// Exact up to `limit` poses; above that, at most `limit` inducing poses.
[[nodiscard]] Confidence confidence_of(const Trained& trained, int limit);

}  // namespace posed::gp
