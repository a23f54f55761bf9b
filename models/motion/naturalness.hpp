// Measures of how natural a motion is (models/motion/README.md, "Naturalness"): jerk, log
// dimensionless jerk and spectral arc length of a speed profile, and the Frechet distance between
// the features of two motions. A value alone has no meaning; compare it with that of a recording of
// the same person. Cold.
#pragma once

#include <span>

#include <Eigen/Core>

#include "proto/frame/result.hpp"

namespace posed::motion {

// One row per frame, one column per channel.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Root mean square of the third difference over frames and channels, in units/frame^3; times
// rate_hz^3 it is in units/s^3. 0 for fewer than four frames.
[[nodiscard]] double jerk_rms(const Rows& rows);

// Speed of every frame step: the length of the difference of two rows, times the rate.
[[nodiscard]] Eigen::VectorXd speed_of(const Rows& rows, double rate_hz);

// -ln(T^3 / v_peak^2 * integral of (d^2 v / dt^2)^2): closer to 0 is smoother; a minimum-jerk reach
// has about -5.2. NaN for fewer than three values or a speed that is always 0.
[[nodiscard]] double log_dimensionless_jerk(std::span<const double> speed, double rate_hz);

// Arc length of the speed's normalised amplitude spectrum up to 10 Hz or where it stays below 0.05
// (Balasubramanian et al. 2015, zero-padded to 2^4 times the next power of two): closer to 0 is
// smoother; a minimum-jerk reach has about -1.4. A ripple below the amplitude bound has no effect
// on it, so report both measures. NaN for fewer than two values or a speed that is always 0.
[[nodiscard]] double spectral_arc_length(std::span<const double> speed, double rate_hz);

// Mean and covariance (over n - 1) of rows.
struct Gaussian {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

// |m1 - m2|^2 + tr(S1 + S2 - 2 (S1 S2)^(1/2)), at least 0.
[[nodiscard]] double frechet_distance(const Gaussian& a, const Gaussian& b);

// Sums over the features of a motion; sums of several motions can be added and subtracted. Features
// are computed over windows of 30 frames, one at every second frame: each channel's
// mean, and the mean size of its change per frame.
struct WindowSums {
  double count = 0.0;      // windows
  Eigen::VectorXd first;   // sum of the features [2 x channels]
  Eigen::MatrixXd second;  // sum of their products

  void add(const WindowSums& other);
  void subtract(const WindowSums& other);
};
[[nodiscard]] WindowSums window_sums(const Rows& rows);

// The most principal components that so many windows determine: one for every ten of them.
[[nodiscard]] int most_dimensions(double windows);

// Frechet distance of the features, projected on the first `dimensions` principal components of
// both together; both have at least two windows.
[[nodiscard]] double window_distance(const WindowSums& a, const WindowSums& b, int dimensions);

// Frechet distance between the features (those of WindowSums) of two motions, on the first
// `dimensions` principal components. Fewer dimensions are used where the motions are too short for
// ten windows per dimension; an error is returned where even one dimension is too many.
Result<double> motion_distance(const Rows& a, const Rows& b, int dimensions = 20);

}  // namespace posed::motion
