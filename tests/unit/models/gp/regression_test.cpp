// The kernel of Sato et al. (models/gp/README.md, "Kernel") against the numpy and scikit-learn
// fixture (tests/golden/gpr.json).
#include "models/gp/regression.hpp"

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include "tests/unit/models/gp/golden_gpr.hpp"

using namespace posed;
using test::relative_error;

TEST_CASE("log marginal likelihood and its gradient agree with the fixture", "[gp]") {
  const auto golden = test::gpr();
  const auto h = gp::Hyper::of(test::vector(golden["h"]));
  const auto evidence = gp::log_marginal(test::matrix(golden["X"]), test::matrix(golden["Y"]), h);
  CHECK(evidence.log_likelihood == Approx(golden["lml"].get<double>()).epsilon(1e-7));
  CHECK(relative_error(evidence.gradient, test::vector(golden["grad"])) < 1e-7);
}

TEST_CASE("weights, mean and variance agree with the fixture", "[gp]") {
  const auto golden = test::gpr();
  const Eigen::MatrixXd Y = test::matrix(golden["Y"]);
  const auto h = gp::Hyper::of(test::vector(golden["h"]));
  const auto trained = gp::fit(test::matrix(golden["X"]), Y, Eigen::VectorXd::Zero(Y.cols()), h);
  REQUIRE(trained);
  CHECK(relative_error(trained->weights, test::matrix(golden["alpha"])) < 1e-7);
  const auto at = gp::posterior(*trained, test::matrix(golden["Xs"]));
  CHECK(relative_error(at.mean, test::matrix(golden["mean"])) < 1e-7);
  CHECK(relative_error(at.variance, test::vector(golden["var_f"])) < 1e-7);
}

TEST_CASE("a prior mean is added back: offset and residual are the same function", "[gp]") {
  const auto golden = test::gpr();
  const Eigen::MatrixXd X = test::matrix(golden["X"]);
  const Eigen::MatrixXd Y = test::matrix(golden["Y"]);
  auto h = gp::Hyper::of(test::vector(golden["h"]));
  h.log_b = -std::numeric_limits<double>::infinity();
  const Eigen::VectorXd offset = Y.colwise().mean();
  const auto trained = gp::fit(X, Y, offset, h);
  REQUIRE(trained);
  CHECK(trained->b == 0.0);
  const Eigen::MatrixXd far = Eigen::MatrixXd::Constant(1, X.cols(), 1e4);
  CHECK(relative_error(gp::posterior(*trained, far).mean, offset.transpose()) < 1e-12);
}

TEST_CASE("the variance runs from the noise to the signal's", "[gp]") {
  const auto golden = test::gpr();
  const Eigen::MatrixXd X = test::matrix(golden["X"]);
  auto h = gp::Hyper::of(test::vector(golden["h"]));
  h.log_b = -std::numeric_limits<double>::infinity();
  const auto trained =
      gp::fit(X, test::matrix(golden["Y"]), Eigen::VectorXd::Zero(golden["Y"][0].size()), h);
  REQUIRE(trained);
  CHECK(gp::posterior(*trained, X).variance.maxCoeff() <= std::exp(h.log_noise));
  const Eigen::MatrixXd far = Eigen::MatrixXd::Constant(1, X.cols(), 1e4);
  CHECK(gp::posterior(*trained, far).variance[0] == Approx(std::exp(h.lambda)));
}

TEST_CASE("bad training data is refused with an error message", "[gp]") {
  const Eigen::MatrixXd X = Eigen::MatrixXd::Zero(3, 2);
  const Eigen::MatrixXd Y = Eigen::MatrixXd::Ones(3, 1);
  const Eigen::VectorXd offset = Eigen::VectorXd::Zero(1);
  const double none = -std::numeric_limits<double>::infinity();
  CHECK_FALSE(gp::fit(X, Y.topRows(2), offset, {}));
  CHECK_FALSE(gp::fit(X, Y * std::nan(""), offset, {}));
  CHECK_FALSE(gp::fit(X, Y, offset, {0.0, 0.0, none, none}));  // three equal points, no noise
  const auto evidence = gp::log_marginal(X, Y, {0.0, 0.0, none, none});
  CHECK(evidence.log_likelihood == none);
}
