// Eigenvalues and eigenvectors of a symmetric matrix. In a file of its own because every file that
// unfolds Eigen's solver takes 8 s longer to compile.
#pragma once

#include <Eigen/Core>

namespace posed::motion {

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // of length 1, one a column, in the order of `values`
};

// Reads the lower triangle. Cold; it allocates.
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& symmetric);

}  // namespace posed::motion
