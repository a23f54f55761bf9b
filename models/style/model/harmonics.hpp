// Harmonic regression of periodic motion: the basis [1, cos n theta, sin n theta], cycles by least
// squares on it, and the stride frequency of a leg signal. Cold.
#pragma once

#include <Eigen/Core>

namespace posed::style {

// theta0 + t dtheta for t = 0 .. frames-1.
[[nodiscard]] Eigen::VectorXd clip_phase(double theta0, double dtheta, int frames);

// The grid 2 pi t / frames, t = 0 .. frames-1, of one cycle.
[[nodiscard]] Eigen::VectorXd cycle_phases(int frames);

// Rows [1, cos theta .. cos H theta, sin theta .. sin H theta].
[[nodiscard]] Eigen::MatrixXd harmonic_basis(const Eigen::VectorXd& theta, int harmonics);

// Least-squares coefficients [2H+1 x D] of `y` (one row per phase), with a small ridge that keeps
// them bounded when there are few frames.
[[nodiscard]] Eigen::MatrixXd fit_harmonics(const Eigen::VectorXd& theta, const Eigen::MatrixXd& y,
                                            int harmonics);

inline constexpr int kCycleHarmonics =
    4;  // mean and 4 harmonics describe the cycle of a pose down to its noise
inline constexpr int kCycleRows = 2 * kCycleHarmonics + 1;  // coefficients
inline constexpr int kGridFrames = 28;                      // points that stand for a cycle

// Harmonic coefficients of a cycle to its kGridFrames points.
[[nodiscard]] Eigen::MatrixXd grid_basis();

// Phase of the first harmonic of `signal` under the phases `theta`: signal ~ A cos(theta - phase).
[[nodiscard]] double first_harmonic_phase(const Eigen::VectorXd& theta,
                                          const Eigen::VectorXd& signal);

// Harmonics that describe a leg's swing.
inline constexpr int kStrideHarmonics = 3;

// 0 to 0.2: how little of a leg signal's swing is in its first harmonic, from the coefficients of
// its kStrideHarmonics. Prevents two strides from being taken for one.
[[nodiscard]] double weak_first_penalty(const Eigen::VectorXd& coefficients);

struct Stride {
  double theta0 = 0.0;  // phase of the first frame: signal ~ A cos(theta0 + t dtheta)
  double dtheta = 0.0;  // rad per frame
  double score = 0.0;   // relative residual of the fit, plus the penalty; 0 is a perfect stride
};

// The stride frequency of a leg signal sampled at `rate_hz`: the period from 0.6 to 2.6 s (and no
// longer than the signal) that three harmonics fit best, with a penalty on a weak first harmonic,
// which prevents two strides from being taken for one (models/style/README.md, "Stride"). Needs
// has_stride().
[[nodiscard]] Stride find_stride(const Eigen::VectorXd& signal, double rate_hz);

// Whether `frames` at `rate_hz` can hold a stride at all.
[[nodiscard]] bool has_stride(int frames, double rate_hz);
inline constexpr double kMinStride_s = 0.6;
inline constexpr double kMaxStride_s = 2.6;

}  // namespace posed::style
