#include "models/motion/symmetric_eigen.hpp"

#include <Eigen/Eigenvalues>

namespace posed::motion {

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace posed::motion
