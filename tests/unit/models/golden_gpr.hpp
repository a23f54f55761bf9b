// Readers of the Gaussian process fixture, shared by the regression and SCG tests.
#pragma once

#include <fstream>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "tests/support/shared.hpp"

namespace posed::test {

inline nlohmann::json gpr() {
  std::ifstream file(golden("gpr.json"));
  return nlohmann::json::parse(file);
}

inline Eigen::VectorXd vector(const nlohmann::json& list) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(list.size()));
  for (Eigen::Index i = 0; i < v.size(); ++i)
    v[i] = list[static_cast<std::size_t>(i)].get<double>();
  return v;
}

inline Eigen::MatrixXd matrix(const nlohmann::json& rows) {
  Eigen::MatrixXd m(static_cast<Eigen::Index>(rows.size()),
                    static_cast<Eigen::Index>(rows[0].size()));
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    m.row(i) = vector(rows[static_cast<std::size_t>(i)]).transpose();
  }
  return m;
}

// Largest difference over the largest expected magnitude.
template <typename A, typename B>
double relative_error(const Eigen::MatrixBase<A>& got, const Eigen::MatrixBase<B>& expected) {
  return (got - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

}  // namespace posed::test
