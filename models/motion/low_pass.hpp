// Zero-phase Butterworth low-pass of the fourth order: run forwards, then backwards over the signal
// extended by point reflection at both ends (scipy's butter(4) and filtfilt with its default
// padding, to rounding). Cold.
#pragma once

#include <Eigen/Core>

namespace posed::motion {

// Filters each column of `signal` [frames x channels]. `cutoff` is a fraction of half the sample
// rate, between 0 and 1. Fewer than two frames come back as they are.
[[nodiscard]] Eigen::MatrixXd low_pass_zero_phase(const Eigen::MatrixXd& signal, double cutoff);

}  // namespace posed::motion
