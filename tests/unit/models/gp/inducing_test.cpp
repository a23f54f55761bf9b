// A process on a few inducing poses predicts what the process on all poses does.
#include "models/gp/inducing.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "models/gp/synthetic.hpp"
#include "proto/frame/degree.hpp"

using namespace posed;

namespace {

gp::Hyper hyper_of(const gp::Trained& process) {
  return {process.lambda, std::log(process.mu), -std::numeric_limits<double>::infinity(),
          std::log(process.noise)};
}

}  // namespace

TEST_CASE("inducing poses predict within 0.1 degrees of all poses", "[gp][inducing]") {
  const gp::SyntheticProcess synthetic = gp::synthetic(700, 63);
  const gp::Trained& all = synthetic.process;
  const Eigen::MatrixXd Y = gp::posterior_mean(all, all.inputs);
  const auto exact = gp::fit(all.inputs, Y, all.offset, hyper_of(all)).value();
  const auto few = gp::fit_inducing(all.inputs, Y, all.offset, hyper_of(all), 300).value();
  CHECK(few.inputs.rows() <= 300);
  const Eigen::MatrixXd error =
      gp::posterior_mean(few, synthetic.queries) - gp::posterior_mean(exact, synthetic.queries);
  CHECK(std::sqrt(error.squaredNorm() / static_cast<double>(error.size())) < 0.1 * kDegree);
}

TEST_CASE("as many inducing poses as there are poses give back their kernel", "[gp][inducing]") {
  const Eigen::MatrixXd X = gp::synthetic(40, 12).process.inputs;
  const double mu = 4.0;
  const auto chosen = gp::choose_inducing(X, mu, 40, [](double) { return false; });
  const Eigen::MatrixXd kernel = gp::rbf(X, X, 0.0, mu);
  CHECK((chosen.factor * chosen.factor.transpose() - kernel).cwiseAbs().maxCoeff() < 1e-5);
  const Eigen::MatrixXd root = chosen.root();
  CHECK((root * root.transpose() - kernel(chosen.chosen(), chosen.chosen())).cwiseAbs().maxCoeff() <
        1e-12);
}

TEST_CASE("broken training values are refused with inducing poses, too", "[gp][inducing]") {
  const gp::Trained process = gp::synthetic(40, 12).process;
  CHECK_FALSE(gp::fit_inducing(process.inputs, process.inputs * std::nan(""), process.offset,
                               hyper_of(process), 10));
}
