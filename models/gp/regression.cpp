#include "models/gp/regression.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>

namespace posed::gp {
namespace {

constexpr double kLogBound = 30.0;  // beyond it exp() gives values of no sensible scale

Eigen::MatrixXd squared_distances(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd d2(a.rows(), b.rows());
  for (Eigen::Index j = 0; j < b.rows(); ++j) {
    d2.col(j) = (a.rowwise() - b.row(j)).rowwise().squaredNorm();
  }
  return d2;
}

Eigen::LLT<Eigen::MatrixXd> factorise(const Eigen::MatrixXd& rbf_part, double b, double noise) {
  Eigen::MatrixXd C = rbf_part.array() + b;
  C.diagonal().array() += noise;
  return Eigen::LLT<Eigen::MatrixXd>(C);
}

bool failed(const Eigen::LLT<Eigen::MatrixXd>& llt) {
  // LLT reports Success on a NaN matrix, so its diagonal is checked.
  return llt.info() != Eigen::Success || !llt.matrixLLT().diagonal().allFinite();
}

}  // namespace

Eigen::MatrixXd rbf(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double lambda, double mu) {
  return (lambda - 0.5 * mu * squared_distances(a, b).array()).exp();
}

Evidence log_marginal(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y, const Hyper& hyper) {
  const double mu = std::exp(hyper.log_mu);
  const double b = std::exp(hyper.log_b);
  const double noise = std::exp(hyper.log_noise);
  const auto n = static_cast<double>(Y.rows());
  const auto outputs = static_cast<double>(Y.cols());
  const Eigen::MatrixXd d2 = squared_distances(X, X);
  const Eigen::MatrixXd E = (hyper.lambda - 0.5 * mu * d2.array()).exp();
  const auto llt = factorise(E, b, noise);
  if (failed(llt)) return {-std::numeric_limits<double>::infinity(), Eigen::Vector4d::Zero()};
  const Eigen::MatrixXd alpha = llt.solve(Y);
  const Eigen::MatrixXd inverse = llt.solve(Eigen::MatrixXd::Identity(X.rows(), X.rows()));
  const double half_log_det = llt.matrixLLT().diagonal().array().log().sum();
  Evidence evidence;
  evidence.log_likelihood = -0.5 * Y.cwiseProduct(alpha).sum() - outputs * half_log_det -
                            0.5 * n * outputs * std::log(2.0 * std::numbers::pi);
  // G = (alpha alpha' - D C^-1) / 2; each derivative is the sum of G times dC/dh.
  const Eigen::MatrixXd G = 0.5 * (alpha * alpha.transpose() - outputs * inverse);
  const Eigen::MatrixXd GE = G.cwiseProduct(E);
  evidence.gradient = {GE.sum(), -0.5 * mu * GE.cwiseProduct(d2).sum(), b * G.sum(),
                       noise * G.trace()};
  return evidence;
}

ScgResult maximise_evidence(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y, const Hyper& start,
                            double min_noise, const ScgOptions& options) {
  const auto raised = [&](const Eigen::VectorXd& h) {
    Hyper hyper = Hyper::of(h);
    hyper.log_noise = std::log(min_noise + std::exp(hyper.log_noise));
    return hyper;
  };
  const auto value = [&](const Eigen::VectorXd& h) {
    if (!(h.lpNorm<Eigen::Infinity>() <= kLogBound)) return std::numeric_limits<double>::infinity();
    return -log_marginal(X, Y, raised(h)).log_likelihood;
  };
  const auto gradient = [&](const Eigen::VectorXd& h) -> Eigen::VectorXd {
    const Hyper hyper = raised(h);
    Eigen::Vector4d by_raised = -log_marginal(X, Y, hyper).gradient;
    by_raised[3] *= std::exp(h[3] - hyper.log_noise);  // d log(min + e^s) / ds
    return by_raised;
  };
  ScgResult result = scg_minimise(value, gradient, start.vector(), options);
  result.x = raised(result.x).vector();
  return result;
}

Result<Trained> fit(const Eigen::MatrixXd& X, const Eigen::MatrixXd& Y,
                    const Eigen::VectorXd& offset, const Hyper& hyper) {
  if (X.rows() == 0 || X.rows() != Y.rows() || offset.size() != Y.cols()) {
    return fail("the training inputs, outputs and prior mean differ in shape");
  }
  if (!X.allFinite() || !Y.allFinite() || !offset.allFinite()) {
    return fail("a training value is not finite: look for broken frames in the clips");
  }
  Trained trained;
  trained.inputs = X;
  trained.offset = offset;
  trained.lambda = hyper.lambda;
  trained.mu = std::exp(hyper.log_mu);
  trained.b = std::exp(hyper.log_b);
  trained.noise = std::exp(hyper.log_noise);
  const auto llt = factorise(rbf(X, X, trained.lambda, trained.mu), trained.b, trained.noise);
  if (failed(llt)) {
    return fail("the covariance of the training poses is singular: raise the noise");
  }
  trained.weights = llt.solve(Y.rowwise() - offset.transpose());
  return trained;
}

Eigen::MatrixXd posterior_mean(const Trained& process, const Eigen::MatrixXd& queries) {
  const Eigen::MatrixXd E =
      rbf(process.scaled(process.inputs), process.scaled(queries), process.lambda, process.mu);
  const Eigen::MatrixXd k = E.array() + process.b;
  return (k.transpose() * process.weights).rowwise() + process.offset.transpose();
}

Posterior posterior(const Trained& process, const Eigen::MatrixXd& queries) {
  const Eigen::MatrixXd E =
      rbf(process.scaled(process.inputs), process.scaled(queries), process.lambda, process.mu);
  const Eigen::MatrixXd k = E.array() + process.b;
  const Eigen::MatrixXd X = process.scaled(process.inputs);
  const Eigen::MatrixXd E_xx = rbf(X, X, process.lambda, process.mu);
  const Eigen::MatrixXd v = factorise(E_xx, process.b, process.noise).matrixL().solve(k);
  const double prior = std::exp(process.lambda) + process.b;
  return {.mean = posterior_mean(process, queries),
          .variance = prior - v.colwise().squaredNorm().transpose().array()};
}

}  // namespace posed::gp
