// The float32 predictor against the double regression, on every instruction set this CPU has.
#include "models/gp/predictor.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <vector>

#include <catch2/catch.hpp>

#include "models/gp/isa.hpp"
#include "models/gp/kernel.hpp"
#include "models/gp/regression.hpp"
#include "models/gp/synthetic.hpp"
#include "tests/support/allocations.hpp"

using namespace posed;

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

struct AnyIsa {
  ~AnyIsa() { static_cast<void>(gp::set_isa("auto")); }
};

std::vector<float> floats(const Eigen::MatrixXd& row) {
  const Eigen::VectorXf f = row.reshaped().cast<float>();
  return {f.begin(), f.end()};
}

// Of each query (a row), one column.
Eigen::MatrixXf predict(const gp::Predictor& predictor, const Eigen::MatrixXd& queries,
                        const std::vector<std::uint8_t>& available = {}) {
  Eigen::MatrixXf out(predictor.outputs(), queries.rows());
  for (Eigen::Index i = 0; i < queries.rows(); ++i) {
    const std::vector<float> q = floats(queries.row(i));
    predictor.mean(q, available,
                   {out.col(i).data(), static_cast<std::size_t>(predictor.outputs())});
  }
  return out;
}

double worst_deg(const Eigen::MatrixXf& out, const Eigen::MatrixXd& expected) {
  return (out.transpose().cast<double>() - expected).cwiseAbs().maxCoeff() * kDegrees;
}

}  // namespace

TEST_CASE("the float32 mean is within 1e-3 degree of the double one", "[gp][predictor]") {
  const AnyIsa restore;
  for (const auto& [poses, dims] : {std::pair{200, 43},
                                    {1000, 43},
                                    {1000, 63},
                                    {28, 43},
                                    {333, 288},
                                    {1, 3},
                                    {17, 5},
                                    {64, 16},
                                    {65, 17}}) {
    const gp::SyntheticProcess made = gp::synthetic(poses, dims);
    const auto expected = gp::posterior(made.process, made.queries).mean;
    const auto predictor = gp::Predictor::build(made.process);
    REQUIRE(predictor);
    for (const auto* isa : {"portable", "avx2", "avx512"}) {
      if (!gp::set_isa(isa)) {
        WARN("SKIPPED " << isa << ": this CPU lacks it");
        continue;
      }
      REQUIRE(gp::isa_name() == isa);
      INFO(poses << " poses, " << dims << " dims on " << isa);
      CHECK(worst_deg(predict(*predictor, made.queries), expected) < 1e-3);
    }
  }
}

TEST_CASE("AVX2 and AVX-512 give the same bits", "[gp][predictor]") {
  const AnyIsa restore;
  if (!gp::set_isa("avx512") || !gp::set_isa("avx2")) {
    WARN("SKIPPED same bits: this CPU lacks AVX2 or AVX-512");
    return;
  }
  for (const auto& [poses, dims] :
       {std::pair{200, 43}, {1000, 43}, {1000, 63}, {250, 288}, {100, 7}, {40, 100}}) {
    const gp::SyntheticProcess made = gp::synthetic(poses, dims);
    const auto predictor = gp::Predictor::build(made.process);
    REQUIRE(predictor);
    std::vector<std::uint8_t> available(static_cast<std::size_t>(dims), 1);
    available[2] = 0;
    for (const auto& flags : {std::vector<std::uint8_t>{}, available}) {
      REQUIRE(gp::set_isa("avx2"));
      const Eigen::MatrixXf a = predict(*predictor, made.queries, flags);
      REQUIRE(gp::set_isa("avx512"));
      const Eigen::MatrixXf b = predict(*predictor, made.queries, flags);
      INFO(poses << " poses, " << dims << " dims");
      CHECK(std::memcmp(a.data(), b.data(), sizeof(float) * a.size()) == 0);
    }
  }
}

TEST_CASE("missing dimensions are left out of the distance", "[gp][predictor]") {
  const gp::SyntheticProcess made = gp::synthetic(300, 43);
  const auto predictor = gp::Predictor::build(made.process);
  REQUIRE(predictor);
  std::vector<std::uint8_t> available(43, 1);
  Eigen::MatrixXd seen(300, 40);
  Eigen::MatrixXd asked(made.queries.rows(), 40);
  for (int d = 0, to = 0; d < 43; ++d) {
    if (d == 0 || d == 20 || d == 42) {
      available[static_cast<std::size_t>(d)] = 0;
      continue;
    }
    seen.col(to) = made.process.inputs.col(d);
    asked.col(to++) = made.queries.col(d);
  }
  // The reference has the same weights; its distance runs over 40 of 43 dimensions, scaled by 43 /
  // 40.
  gp::Trained reference = made.process;
  reference.inputs = seen;
  reference.mu *= 43.0 / 40.0;
  const auto expected = gp::posterior(reference, asked).mean;
  Eigen::MatrixXd queries = made.queries;
  queries.col(20).setConstant(std::numeric_limits<double>::quiet_NaN());  // must not be read
  CHECK(worst_deg(predict(*predictor, queries, available), expected) < 1e-3);

  const Eigen::MatrixXf none = predict(*predictor, queries, std::vector<std::uint8_t>(43, 0));
  CHECK(none.col(0) == made.process.offset.cast<float>());
}

TEST_CASE("far from all poses the result is the constant", "[gp][predictor]") {
  gp::SyntheticProcess made = gp::synthetic(100, 43);
  made.process.b = 0.02;
  const auto predictor = gp::Predictor::build(made.process);
  REQUIRE(predictor);
  const Eigen::MatrixXd far = Eigen::MatrixXd::Constant(2, 43, 1e6);
  CHECK(worst_deg(predict(*predictor, far), gp::posterior(made.process, far).mean) < 1e-3);
  const Eigen::MatrixXf out = predict(*predictor, far);
  CHECK(std::equal(predictor->constant().begin(), predictor->constant().end(), out.col(1).data()));
}

TEST_CASE("the kernel's exponential is right to an ulp and reaches exactly zero",
          "[gp][predictor]") {
  const AnyIsa restore;
  std::vector<float> x;
  for (int i = 0; i < 160'000; ++i) x.push_back(-static_cast<float>(i) * 7.9e-4F);
  std::vector<float> y(x.size());
  for (const auto* isa : {"portable", "avx2", "avx512"}) {
    if (!gp::set_isa(isa)) continue;
    gp::kernel::exp2_of(x.data(), static_cast<int>(x.size()), y.data());
    double worst = 0.0;
    for (std::size_t i = 0; i < x.size() && x[i] >= -125.0F; ++i) {
      const double exact = std::exp2(static_cast<double>(x[i]));
      worst = std::max(worst, std::abs(y[i] / exact - 1.0));
    }
    INFO(isa);
    CHECK(worst < 1.2e-7);
    CHECK(y[0] == 1.0F);
    CHECK(y.back() == 0.0F);
  }
  std::vector<float> extreme(16, -std::numeric_limits<float>::infinity());
  extreme[1] = -1e30F;
  gp::kernel::exp2_of(extreme.data(), 16, extreme.data());
  CHECK(extreme[0] == 0.0F);
  CHECK(extreme[1] == 0.0F);
}

TEST_CASE("a prediction does not allocate", "[gp][predictor]") {
  const gp::SyntheticProcess made = gp::synthetic(300, 43);
  const auto predictor = gp::Predictor::build(made.process).value();
  const std::vector<float> q = floats(made.queries.row(0));
  std::vector<std::uint8_t> available(43, 1);
  available[5] = 0;
  std::vector<float> out(43);
  const std::uint64_t before = test::allocations();
  predictor.mean(q, {}, out);
  predictor.mean(q, available, out);
  CHECK(test::allocations() == before);
}

TEST_CASE("an invalid process is refused with an error message", "[gp][predictor]") {
  const gp::Trained good = gp::synthetic(28, 10).process;
  const auto refused = [&](auto&& spoil) {
    gp::Trained bad = good;
    spoil(bad);
    return !gp::Predictor::build(bad).has_value();
  };
  const double nan = std::nan("");
  CHECK_FALSE(refused([](gp::Trained&) {}));
  CHECK(refused([](gp::Trained& t) { t.inputs.resize(0, 10); }));
  CHECK(refused([](gp::Trained& t) { t.inputs.resize(28, 0); }));
  CHECK(refused([](gp::Trained& t) { t.inputs = Eigen::MatrixXd::Zero(28, 289); }));
  CHECK(refused([](gp::Trained& t) { t.weights.conservativeResize(27, 10); }));
  CHECK(refused([](gp::Trained& t) { t.offset.conservativeResize(9); }));
  CHECK(refused([&](gp::Trained& t) { t.inputs(3, 3) = nan; }));
  CHECK(refused([&](gp::Trained& t) { t.weights(3, 3) = nan; }));
  CHECK(refused([](gp::Trained& t) { t.weights *= 1e40; }));
  CHECK(refused([](gp::Trained& t) { t.mu = 0.0; }));
  CHECK(refused([](gp::Trained& t) { t.b = -1.0; }));
  CHECK(refused([&](gp::Trained& t) { t.lambda = nan; }));
  CHECK(refused([](gp::Trained& t) { t.lambda = 1000.0; }));
}

TEST_CASE("an unknown instruction set is refused", "[gp][predictor]") {
  const AnyIsa restore;
  CHECK_FALSE(gp::set_isa("neon9"));
  REQUIRE(gp::set_isa("portable"));
  CHECK(gp::isa_name() == "portable");
}
