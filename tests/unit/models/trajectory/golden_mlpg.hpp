// Readers of the trajectory fixture (tests/golden/mlpg.json): information rows and expected
// trajectories.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/trajectory/information_form.hpp"
#include "tests/support/golden_json.hpp"

namespace posed::test {

using Table = std::vector<std::vector<double>>;  // [frame][channel]

inline trajectory::InformationForm information_of(const nlohmann::json& golden,
                                                  bool with_observations) {
  const auto mean = golden["mean"].get<std::vector<Table>>();
  const auto variance = golden["var"].get<std::vector<Table>>();
  const auto seen = golden["obs"].get<Table>();
  const auto precision = golden["obs_precision"].get<Table>();
  trajectory::InformationForm information(golden["M"].get<int>(), golden["T"].get<int>());
  for (int t = 0; t < information.frames(); ++t) {
    for (int c = 0; c < information.channels(); ++c) {
      for (int w = 0; w < 3; ++w) {
        const double p = 1.0 / variance[t][w][c];
        information.row(t, static_cast<trajectory::Row>(2 * w))[c] = p;
        information.row(t, static_cast<trajectory::Row>(2 * w + 1))[c] = p * mean[t][w][c];
      }
      if (with_observations) {
        information.row(t, trajectory::kPosition)[c] += precision[t][c];
        information.row(t, trajectory::kPositionMean)[c] += precision[t][c] * seen[t][c];
      }
    }
  }
  return information;
}

inline std::vector<const double*> frames_of(const trajectory::InformationForm& information) {
  std::vector<const double*> frames;
  for (int t = 0; t < information.frames(); ++t) frames.push_back(information.frame(t));
  return frames;
}

// Largest difference of a row from the expected one.
inline double off(const double* row, const std::vector<double>& expected) {
  double worst = 0.0;
  for (std::size_t c = 0; c < expected.size(); ++c) {
    const double difference = std::abs(row[c] - expected[c]);
    worst = difference <= worst ? worst : difference;  // so that NaN counts as a difference
  }
  return worst;
}

}  // namespace posed::test
