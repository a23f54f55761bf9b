// The MGPM against the numeric fixture: posterior, gradient, kernel series, mean cycle.
#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/gp/lbfgs.hpp"
#include "models/style/train/mgpm.hpp"
#include "tests/support/shared.hpp"

namespace {

using Eigen::VectorXd;
using nlohmann::json;
using posed::style::MgpmData;
using posed::style::MgpmParams;
using posed::style::MgpmPrior;

constexpr int kFixtureHarmonics = 14;

json fixture() { return json::parse(std::ifstream(posed::test::golden("mgpm.json"))); }

VectorXd vector_of(const json& list) {
  const auto values = list.get<std::vector<double>>();
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

MgpmData data_of(const json& f) {
  MgpmData data;
  data.clip_frames = f["clip_lengths"].get<std::vector<int>>();
  data.clip_subject = f["clip_subject"].get<std::vector<int>>();
  data.y.resize(static_cast<int>(f["Y"].size()), static_cast<int>(f["Y"][0].size()));
  for (int i = 0; i < data.y.rows(); ++i) data.y.row(i) = vector_of(f["Y"][i]).transpose();
  return data;
}

// The fixture's flat order: xi row-major, theta0, dtheta, log gamma, log noise.
MgpmParams params_of(const VectorXd& p, int subjects, int q, int clips) {
  MgpmParams params;
  params.xi =
      Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(p.data(), subjects, q);
  params.theta0 = p.segment(subjects * q, clips);
  params.dtheta = p.segment(subjects * q + clips, clips);
  params.log_gamma = p[p.size() - 2];
  params.log_noise = p[p.size() - 1];
  return params;
}

VectorXd flat(const MgpmParams& params) {
  VectorXd p(params.xi.size() + 2 * params.theta0.size() + 2);
  const Eigen::Matrix<double, -1, -1, Eigen::RowMajor> xi = params.xi;
  p << Eigen::Map<const VectorXd>(xi.data(), xi.size()), params.theta0, params.dtheta,
      params.log_gamma, params.log_noise;
  return p;
}

void check_close(const VectorXd& got, const VectorXd& want, double relative) {
  REQUIRE(got.size() == want.size());
  CHECK((got - want).lpNorm<Eigen::Infinity>() <= relative * want.lpNorm<Eigen::Infinity>());
}

}  // namespace

TEST_CASE("MGPM posterior and gradient agree with the fixture", "[mgpm]") {
  const json f = fixture();
  const MgpmData data = data_of(f);
  const MgpmParams params = params_of(vector_of(f["p"]), 3, f["q"], data.clips());
  const MgpmPrior prior{vector_of(f["dth_ref"]), 0.1};
  const VectorXd given = vector_of(f["w"]);
  for (const std::string name : {"given_w", "profiled_w"}) {
    const json& want = f["values"][name];
    const VectorXd* scale = name == "given_w" ? &given : nullptr;
    const auto bare = mgpm_evaluate(data, params, nullptr, scale, kFixtureHarmonics);
    CHECK(bare.nlp == Approx(want["nll_no_prior"].get<double>()).epsilon(1e-7));
    check_close(flat(bare.gradient), vector_of(want["grad_no_prior"]), 1e-7);
    check_close(bare.scale, vector_of(want["w"]), 1e-7);
    const auto full = mgpm_evaluate(data, params, &prior, scale, kFixtureHarmonics);
    CHECK(full.nlp == Approx(want["nll"].get<double>()).epsilon(1e-7));
    check_close(flat(full.gradient), vector_of(want["grad"]), 1e-7);
  }
  const auto exact = mgpm_evaluate(data, params, nullptr, &given, kFixtureHarmonics).nlp;
  for (const int harmonics : {4, 8, 10}) {
    const double error = mgpm_evaluate(data, params, nullptr, &given, harmonics).nlp - exact;
    CHECK(error == Approx(f["truncation_error"][std::to_string(harmonics)].get<double>())
                       .epsilon(1e-3)
                       .margin(1e-9));
  }
}

TEST_CASE("The circular kernel's series agrees with the fixture and with itself", "[mgpm]") {
  const auto kernel = posed::style::circular_kernel(1.4, 8);
  check_close(kernel.a, vector_of(fixture()["fourier_a_gamma1p4"]), 1e-12);
  for (const double gamma : {1e-3, 0.3, 2.0, 9.0, 80.0}) {
    const auto k = posed::style::circular_kernel(gamma, 60);
    CHECK(k.a.squaredNorm() == Approx(1.0).epsilon(1e-10));  // exp(0) at d = 0
    const double h = 1e-6 * gamma;
    const VectorXd numeric = (posed::style::circular_kernel(gamma + h, 60).a -
                              posed::style::circular_kernel(gamma - h, 60).a) /
                             (2 * h);
    CHECK((numeric - k.da).head(3).norm() < 1e-5 * (1.0 + k.da.head(3).norm()));
  }
}

TEST_CASE("The MGPM mean cycle agrees with the fixture", "[mgpm]") {
  const json f = fixture();
  const MgpmData data = data_of(f);
  const MgpmParams params = params_of(vector_of(f["p"]), 3, f["q"], data.clips());
  const auto cycle = mgpm_cycle(data, params, vector_of(f["predict"]["xi"]),
                                vector_of(f["predict"]["theta"]), kFixtureHarmonics);
  for (int t = 0; t < cycle.rows(); ++t) {
    check_close(cycle.row(t).transpose(), vector_of(f["predict"]["cycle"][t]), 1e-7);
  }
}

TEST_CASE("MGPM training reaches the fixture's optimum from every start", "[mgpm]") {
  using posed::style::MgpmStart;
  const json f = fixture();
  const MgpmData data = data_of(f);
  const MgpmParams params = params_of(vector_of(f["p"]), 3, f["q"], data.clips());
  const auto fits = mgpm_train(data, params.theta0, params.dtheta,
                               {.style_dims = 2,
                                .starts = {MgpmStart::kSvd, MgpmStart::kRandom, MgpmStart::kRandom},
                                .seed = 1,
                                .progress = {}});
  REQUIRE(fits.has_value());
  REQUIRE(fits->size() == 3);
  const double want = f["trained"]["final_nlp"][0];
  for (const auto& fit : *fits) CHECK(fit.nlp == Approx(want).margin(1e-3));
  const auto again =
      mgpm_train(data, params.theta0, params.dtheta,
                 {.style_dims = 2, .starts = {MgpmStart::kRandom}, .seed = 9, .progress = {}});
  const auto same =
      mgpm_train(data, params.theta0, params.dtheta,
                 {.style_dims = 2, .starts = {MgpmStart::kRandom}, .seed = 9, .progress = {}});
  CHECK(again->front().params.xi == same->front().params.xi);
}

TEST_CASE("MGPM training runs with fewer subjects than style dimensions, and stops when asked",
          "[mgpm]") {
  const json f = fixture();
  MgpmData data = data_of(f);
  data.clip_frames.resize(2);
  data.clip_subject.resize(2);
  data.y.conservativeResize(data.clip_frames[0] + data.clip_frames[1], Eigen::NoChange);
  data.y.rowwise() -= Eigen::RowVectorXd(data.y.colwise().mean());
  const MgpmParams params = params_of(vector_of(f["p"]), 3, f["q"], 4);
  const auto fits = mgpm_train(data, params.theta0.head(2), params.dtheta.head(2), {});
  REQUIRE(fits.has_value());
  CHECK(fits->front().params.xi.cols() == 2);
  CHECK(std::isfinite(fits->front().nlp));
  posed::style::MgpmOptions options;
  options.progress = [](double) { return false; };
  CHECK_FALSE(mgpm_train(data, params.theta0.head(2), params.dtheta.head(2), options).has_value());
}

TEST_CASE("L-BFGS finds the minimum of Rosenbrock's valley in twenty dimensions", "[lbfgs]") {
  const posed::gp::Objective valley = [](const VectorXd& x, VectorXd& g) {
    double f = 0.0;
    g.setZero();
    for (int i = 0; i + 1 < x.size(); ++i) {
      const double a = x[i + 1] - x[i] * x[i];
      const double b = 1.0 - x[i];
      f += 100.0 * a * a + b * b;
      g[i] += -400.0 * a * x[i] - 2.0 * b;
      g[i + 1] += 200.0 * a;
    }
    return f;
  };
  const auto found = posed::gp::lbfgs_minimise(
      valley, VectorXd::Constant(20, -0.5),
      {.max_iterations = 500, .relative_change = 0.0, .max_gradient = 1e-8});
  CHECK((found.x.array() - 1.0).abs().maxCoeff() < 1e-6);
}

TEST_CASE("L-BFGS refuses steps to values that are not finite", "[lbfgs]") {
  const posed::gp::Objective barrier = [](const VectorXd& x, VectorXd& g) {
    g[0] = 1.0 - 1.0 / x[0];
    return x[0] - std::log(x[0]);  // NaN left of zero, minimum at one
  };
  const auto found = posed::gp::lbfgs_minimise(barrier, VectorXd::Constant(1, 8.0),
                                               {.relative_change = 0.0, .max_gradient = 1e-9});
  CHECK(found.x[0] == Approx(1.0).epsilon(1e-6));
}
