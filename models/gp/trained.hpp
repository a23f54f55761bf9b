// Trained: a learnt Gaussian process with the kernel of Sato et al., in double precision, as a
// model file stores it.
//
//   f(q) = offset + sum_i k(q, x_i) w_i,   k(q, x) = exp(lambda - mu |q - x|^2 / 2) + b
//   (models/gp/README.md, "Kernel")
//
// |q - x|^2 counts dimension d scale_d^2 times.
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
  Eigen::VectorXd scale{};  // [D], above 0; empty: all 1

  // Poses [N x D] as the kernel measures them.
  [[nodiscard]] Eigen::MatrixXd scaled(const Eigen::MatrixXd& poses) const {
    return scale.size() == 0 ? poses : Eigen::MatrixXd(poses * scale.asDiagonal());
  }
};

// Another function of the same inputs and kernel as a Trained.
struct Function {
  Eigen::MatrixXd weights;  // [N x D_out], rad
  Eigen::VectorXd offset;   // [D_out], rad
};

}  // namespace posed::gp
