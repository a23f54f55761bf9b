// A synthetic process of the size and shape of a learnt one: walkers with a common cycle of four
// harmonics, each with a posture and a gait of their own. For the benchmark and the tests, which
// run without recordings (models/gp/README.md, "Synthetic process"). Cold.
#pragma once

#include <Eigen/Core>

#include "models/gp/trained.hpp"

namespace posed::gp {

struct SyntheticProcess {
  Trained process;  // [poses x dims] -> dims, length 85 degrees, noise 0.1 of the signal
  Eigen::MatrixXd
      queries;  // [256 x dims]: frames of a walker who is not among the training poses, rad
};

// Equal arguments give equal numbers on every system.
[[nodiscard]] SyntheticProcess synthetic(int poses, int dims);

}  // namespace posed::gp
