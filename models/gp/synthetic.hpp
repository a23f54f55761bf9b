// A made-up process the size and shape of a learnt one: walkers with a common cycle of four
// harmonics, each with a carriage and a gait of their own. For the benchmark and the tests, where
// no recording may be. Cold.
#pragma once

#include <Eigen/Core>

#include "models/gp/trained.hpp"

namespace posed::gp {

struct SyntheticProcess {
  Trained process;          // [poses x dims] -> dims, length 85 degrees, noise 0.1 of the signal
  Eigen::MatrixXd queries;  // [256 x dims]: frames of a walker who is not in it, rad
};

// The same arguments give the same numbers everywhere.
[[nodiscard]] SyntheticProcess synthetic(int poses, int dims);

}  // namespace posed::gp
