// Trains an MGPM: several starts, each optimised in two stages (README.md, "Optimisation"). The
// result is a function of the data and the seed alone. Cold; thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "models/style/train/mgpm.hpp"
#include "models/tasks.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

// Receives the fraction done, 0 to 1; returning false stops the training soon.
using Progress = std::function<bool(double fraction)>;

enum class MgpmStart : std::uint8_t { kSvd, kRandom };  // where the style points begin

struct MgpmOptions {
  int style_dims = 3;  // q; at most the number of subjects is used
  std::vector<MgpmStart> starts{MgpmStart::kSvd, MgpmStart::kRandom};
  std::uint64_t seed = 0;
  TaskRunner* tasks = nullptr;  // each start is a task; not owned; null: one after another
  Progress progress;            // may be empty
};

struct MgpmFit {
  MgpmParams params;
  MgpmPrior prior;
  double nlp = 0.0;
  Eigen::VectorXd scale;  // w
  int harmonics = 10;     // that the kernel's series needs at this gamma
  int evaluations = 0;
};

// The fits of all starts, the best first. The common turn of all phases, which the likelihood
// leaves undetermined, is fixed by holding the first clip's phase. The only error is that
// `progress` asked to stop.
[[nodiscard]] Result<std::vector<MgpmFit>> mgpm_train(const MgpmData& data,
                                                      const Eigen::VectorXd& theta0,
                                                      const Eigen::VectorXd& dtheta,
                                                      const MgpmOptions& options);

}  // namespace posed::style
