// Reads the fixtures of tests/golden as JSON and as matrices.
#pragma once

#include <fstream>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "tests/support/shared.hpp"

namespace posed::test {

inline nlohmann::json golden_json(const std::string& name) {
  std::ifstream file(golden(name));
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

}  // namespace posed::test
