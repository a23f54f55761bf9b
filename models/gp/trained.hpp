// Trained: a learnt Gaussian process with the kernel of Sato et al., in double precision, as a
// model file stores it.
//
//   f(q) = offset + sum_i k(q, x_i) w_i,   k(q, x) = exp(lambda - mu |q - x|^2 / 2) + b (README.md,
//   "Kernel")
#pragma once

#include <Eigen/Core>

namespace posed::gp {

struct Trained {
  Eigen::MatrixXd inputs;   // X [N x D], rad
  Eigen::MatrixXd weights;  // C^-1 (Y - offset) [N x D_out], rad
  Eigen::VectorXd offset;   // prior mean [D_out], rad
  double lambda = 0.0;      // log signal variance
  double mu = 1.0;          // 1 / length^2 [1/rad^2]
  double b = 0.0;           // constant kernel
  double noise = 1e-3;      // sigma^2
};

// Another function of the same inputs and kernel as a Trained.
struct Function {
  Eigen::MatrixXd weights;  // [N x D_out], rad
  Eigen::VectorXd offset;   // [D_out], rad
};

}  // namespace posed::gp
