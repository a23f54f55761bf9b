// Gaussian process regression with the kernel of Sato et al., eq. 4 (models/gp/README.md,
// "Kernel"). All outputs share one set of kernel values, so the covariance is factorised once
// (models/gp/README.md, "Regression"). Double precision, cold, thread-safe.
//
//   k(q, x) = exp(lambda - mu |q - x|^2 / 2) + b,   C = K + sigma^2 I
#pragma once

#include <Eigen/Core>

#include "models/gp/scg.hpp"
#include "models/gp/trained.hpp"
#include "proto/frame/result.hpp"

namespace posed::gp {

// The kernel's values as the optimiser's variables. log_b = -infinity is b = 0, log_noise is log
// sigma^2.
struct Hyper {
  double lambda = 0.0;
  double log_mu = 0.0;
  double log_b = 0.0;
  double log_noise = 0.0;

  [[nodiscard]] Eigen::Vector4d vector() const { return {lambda, log_mu, log_b, log_noise}; }
  [[nodiscard]] static Hyper of(const Eigen::Vector4d& h) { return {h[0], h[1], h[2], h[3]}; }
};

// The evidence (log marginal likelihood), summed over the outputs, and its gradient by lambda, log
// mu, log b, log sigma^2 (models/gp/README.md, "Evidence"). Where C is not positive definite the
// log likelihood is minus infinity and the gradient zero.
struct Evidence {
  double log_likelihood = 0.0;
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
};

// E = exp(lambda - mu d^2 / 2) between the rows of `a` and `b` [a.rows x b.rows]: the kernel
// without its constant.
[[nodiscard]] Eigen::MatrixXd rbf(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double lambda,
                                  double mu);

// The evidence of X [N x D], the inputs, and Y [N x D_out], the outputs less their prior mean.
[[nodiscard]] Evidence log_marginal(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                                    const Hyper& hyper);

// Minimises -log L by scaled conjugate gradients from `start`; the four variables are kept within
// +-30. The noise is min_noise + exp(log_noise), as in NETLAB: otherwise outputs that a smooth map
// explains exactly would drive it to zero and the weights beyond the range of single precision. The
// result's x is Hyper::vector() with min_noise in its noise, its value -log L.
[[nodiscard]] ScgResult maximise_evidence(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                                          const Hyper& start, double min_noise,
                                          const ScgOptions& options = {});

// Computes the weights C^-1 (Y - offset) for Y [N x D_out]. Returns an error when shapes differ, a
// value is not finite, or C is not positive definite.
Result<Trained> fit(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                    const Eigen::VectorXd& offset, const Hyper& hyper);

struct Posterior {
  Eigen::MatrixXd mean;      // [Q x D_out], offset included
  Eigen::VectorXd variance;  // of f [Q], without noise: e^lambda + b - k'C^-1 k
};

// The posterior's mean alone at the rows of `queries` [Q x D]. It needs no factorisation.
[[nodiscard]] Eigen::MatrixXd posterior_mean(const Trained& process,
                                             const Eigen::MatrixXd& queries);

// The posterior at the rows of `queries` [Q x D], against which the float32 predictor is measured.
[[nodiscard]] Posterior posterior(const Trained& process, const Eigen::MatrixXd& queries);

}  // namespace posed::gp
