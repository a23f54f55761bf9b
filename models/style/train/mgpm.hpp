// MGPM: the multifactor Gaussian process model of Sato et al., section 2.1
// (models/style/train/README.md, "Model of phases"). It estimates a style point for each subject
// and a phase and a stride frequency for each clip, which brings the average cycles of all clips
// into common phase.
//
//   theta_i = theta0_m + t dtheta_m
//   cov(y_id, y_jd) = w_d^-2 (xi_i . xi_j exp(-gamma (1 - cos(theta_i - theta_j))) + noise [i = j])
//
// The circular kernel has an exact Fourier series, so the covariance has finite rank and every
// quantity below costs O(N) (models/style/train/README.md, "Cost of one likelihood"); the only
// approximation is the finite number of harmonics. Cold, double precision, no I/O, thread-safe (no
// shared state).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "models/tasks.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

// The training data. Rows of `y` are the frames of clip 0, clip 1, ... in order.
struct MgpmData {
  Eigen::MatrixXd y;              // [N x D], channel means removed, no constant channel
  std::vector<int> clip_frames;   // [M], sums to N
  std::vector<int> clip_subject;  // [M], 0..S-1, each subject has a clip

  [[nodiscard]] int clips() const { return static_cast<int>(clip_frames.size()); }
  [[nodiscard]] int subjects() const;
};

struct MgpmParams {
  Eigen::MatrixXd xi;      // style points [S x q]
  Eigen::VectorXd theta0;  // phase of each clip's first frame [M], rad
  Eigen::VectorXd dtheta;  // phase per frame [M], rad
  double log_gamma = 0.0;  // content kernel
  double log_noise = 0.0;  // of beta^-1 in models/style/train/README.md, "Model of phases"
};

// Weak priors (models/style/train/README.md, "Priors"); Sato et al. give none. They keep the period
// near its first guess and fix the scale of xi, which the likelihood leaves undetermined.
struct MgpmPrior {
  Eigen::VectorXd dtheta_mean;  // [M]; empty: no prior on the stride frequency
  double dtheta_relative_sd = 0.1;
};

struct MgpmValue {
  double nlp = 0.0;       // negative log posterior
  MgpmParams gradient;    // of nlp
  Eigen::VectorXd scale;  // w [D]
};

// The negative log posterior and its gradient at `params`. `scale` gives w; with null, w is
// profiled out in closed form. `prior` may be null. `harmonics` = 10 is enough up to gamma = 4 (the
// kernel is off by 3e-7 at gamma = 3, by 3e-6 at 4).
[[nodiscard]] MgpmValue mgpm_evaluate(const MgpmData& data, const MgpmParams& params,
                                      const MgpmPrior* prior, const Eigen::VectorXd* scale,
                                      int harmonics);

// The prior's part alone.
[[nodiscard]] double mgpm_prior_nlp(const MgpmPrior& prior, const MgpmParams& params);

// a_n >= 0 with exp(-gamma (1 - cos d)) = sum_n a_n^2 cos(n d), n = 0..harmonics, and da_n/dgamma.
struct CircularKernel {
  Eigen::VectorXd a, da;
};
[[nodiscard]] CircularKernel circular_kernel(double gamma, int harmonics);

// The mean cycle of a hypothetical subject with style `xi` at phases `theta` (rows) [T x D]: the GP
// mean, which is linear in xi (models/style/train/README.md, "Mean cycles").
[[nodiscard]] Eigen::MatrixXd mgpm_cycle(const MgpmData& data, const MgpmParams& params,
                                         const Eigen::VectorXd& xi, const Eigen::VectorXd& theta,
                                         int harmonics);

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

// Trains an MGPM from several starts, each optimised in two stages (models/style/train/README.md,
// "Optimisation"). Returns the fits of all starts, the best first; they depend on the data and the
// seed alone. The common turn of all phases, which the likelihood leaves undetermined, is fixed by
// holding the first clip's phase. The only error is that `progress` asked to stop.
Result<std::vector<MgpmFit>> mgpm_train(const MgpmData& data, const Eigen::VectorXd& theta0,
                                        const Eigen::VectorXd& dtheta, const MgpmOptions& options);

}  // namespace posed::style
