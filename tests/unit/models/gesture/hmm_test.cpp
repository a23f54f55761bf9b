// Features, flat start, forward-backward, Baum-Welch, durations and Viterbi against the fixture.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "models/gesture/estimate.hpp"
#include "tests/support/golden_json.hpp"

using namespace posed;
using namespace posed::gesture;
using test::matrix;
using test::vector;

namespace {

constexpr double kHmmTolerance = 1e-6;

double off(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

struct HmmFixture {
  nlohmann::json golden = test::golden_json("hmm.json");
  std::vector<FeatureMatrix> sequences;
  std::vector<Frames> examples;
  Eigen::VectorXd floor = vector(golden["var_floor"]);
  StateModel start;

  HmmFixture() {
    for (const auto& rows : golden["seqs"]) sequences.emplace_back(matrix(rows));
    for (const FeatureMatrix& sequence : sequences) examples.emplace_back(sequence);
    start = estimate(flat_start(examples, 5), floor, {});
  }
};

}  // namespace

TEST_CASE_METHOD(HmmFixture, "Delta features replicate the edges", "[hmm]") {
  const FeatureMatrix features = features_of(sequences[0]);
  REQUIRE(features.cols() == 6);
  CHECK(off(features.leftCols(2), sequences[0]) == 0.0);
  CHECK(off(features.middleCols(2, 2), matrix(golden["delta_first"])) < kHmmTolerance);
  CHECK(off(features.rightCols(2), matrix(golden["delta2_first"])) < kHmmTolerance);
}

TEST_CASE_METHOD(HmmFixture, "Flat start cuts every example into equal parts", "[hmm]") {
  CHECK(off(start.mean, matrix(golden["init"]["mu"])) < kHmmTolerance);
  CHECK(off(start.variance, matrix(golden["init"]["var"])) < kHmmTolerance);
  CHECK(off(start.stay, vector(golden["init"]["aself"])) < kHmmTolerance);
}

TEST_CASE_METHOD(HmmFixture, "Forward-backward gives the fixture's posteriors", "[hmm]") {
  const auto posterior = forward_backward(log_density(examples[0], start), start.stay,
                                          whole_band(examples[0].rows(), 5));
  CHECK(std::abs(posterior.log_likelihood - golden["first_seq"]["loglik"].get<double>()) <
        kHmmTolerance);
  CHECK(off(posterior.gamma, matrix(golden["first_seq"]["gamma"])) < kHmmTolerance);
  CHECK(off(posterior.stays, vector(golden["first_seq"]["self_counts"])) < kHmmTolerance);
  // The fixture sums over every path.
  const auto brief =
      forward_backward(log_density(sequences[0].topRows(7), start), start.stay, whole_band(7, 5));
  CHECK(std::abs(brief.log_likelihood - golden["short7_loglik"].get<double>()) < kHmmTolerance);
}

TEST_CASE_METHOD(HmmFixture, "A band as wide as the truth changes nothing", "[hmm]") {
  const auto density = log_density(examples[0], start);
  const auto whole = forward_backward(density, start.stay, whole_band(density.rows(), 5));
  // A band of three states that follows the states with probability.
  Band band{{}, 3};
  Eigen::MatrixXd narrow(density.rows(), 3);
  for (Eigen::Index t = 0; t < density.rows(); ++t) {
    Eigen::Index best = 0;
    whole.gamma.row(t).maxCoeff(&best);
    const int first = std::clamp(static_cast<int>(best) - 1, 0, 2);
    band.first.push_back(first);
    narrow.row(t) = density.row(t).segment(first, 3);
  }
  const auto banded = forward_backward(narrow, start.stay, band);
  CHECK(std::abs(banded.log_likelihood - whole.log_likelihood) < 0.05);
  CHECK(std::abs(banded.gamma.sum() - static_cast<double>(density.rows())) < 1e-9);
}

TEST_CASE_METHOD(HmmFixture, "Eight rounds of Baum-Welch with durations", "[hmm]") {
  const Fit fit = baum_welch(examples, start, 8, floor);
  const auto& after = golden["after8"];
  CHECK(off(fit.model.mean, matrix(after["mu"])) < kHmmTolerance);
  CHECK(off(fit.model.variance, matrix(after["var"])) < kHmmTolerance);
  CHECK(off(fit.model.stay, vector(after["aself"])) < kHmmTolerance);
  CHECK(off(fit.sums.occupancy, vector(after["occ"])) < kHmmTolerance);
  REQUIRE(fit.log_likelihood.size() == 9);
  for (std::size_t i = 0; i < 9; ++i) {
    CHECK(std::abs(fit.log_likelihood[i] - after["loglik"][i].get<double>()) < kHmmTolerance);
    if (i > 0) CHECK(fit.log_likelihood[i] >= fit.log_likelihood[i - 1] - kHmmTolerance);
  }
}

TEST_CASE_METHOD(HmmFixture, "Baum-Welch ends early where it is asked to", "[hmm]") {
  int asked = 0;
  const Fit fit = baum_welch(examples, start, 8, floor, [&asked] { return ++asked == 3; });
  REQUIRE(fit.log_likelihood.size() == 3);
  const Fit brief = baum_welch(examples, start, 2, floor);
  CHECK(fit.model.mean == brief.model.mean);
  CHECK(fit.sums.log_likelihood == brief.sums.log_likelihood);
}

TEST_CASE_METHOD(HmmFixture, "Viterbi finds the fixture's paths", "[hmm]") {
  const Fit fit = baum_welch(examples, start, 8, floor);
  for (std::size_t i = 0; i < examples.size(); ++i) {
    const Path path = viterbi(log_density(examples[i], fit.model), fit.model.stay);
    CHECK(path.state == golden["viterbi"][i]["states"].get<std::vector<int>>());
    CHECK(std::abs(path.score - golden["viterbi"][i]["score"].get<double>()) < kHmmTolerance);
  }
}

TEST_CASE("Densities that underflow in a linear recursion stay finite", "[hmm]") {
  // A hundred frames a thousand standard deviations off: the linear recursion underflows at the
  // first one.
  FeatureMatrix frames = FeatureMatrix::Constant(100, 3, 1000.0);
  StateModel model{Eigen::MatrixXd::Zero(5, 3), Eigen::MatrixXd::Ones(5, 3),
                   Eigen::VectorXd::Constant(5, 0.9)};
  const auto posterior =
      forward_backward(log_density(frames, model), model.stay, whole_band(100, 5));
  CHECK(std::isfinite(posterior.log_likelihood));
  CHECK(std::abs(posterior.gamma.sum() - 100.0) < 1e-3);
}

TEST_CASE("An example shorter than the states has no path", "[hmm]") {
  const FeatureMatrix frames = FeatureMatrix::Zero(3, 2);
  const StateModel model{Eigen::MatrixXd::Zero(5, 2), Eigen::MatrixXd::Ones(5, 2),
                         Eigen::VectorXd::Constant(5, 0.5)};
  const auto posterior = forward_backward(log_density(frames, model), model.stay, whole_band(3, 5));
  CHECK(posterior.log_likelihood == -std::numeric_limits<double>::infinity());
  CHECK(posterior.gamma.isZero());
}
