// Several functions of one predictor: any mixture in one pass, at rest as cheap as one function.
#include <catch2/catch.hpp>

#include <array>
#include <random>
#include <span>
#include <vector>

#include "models/gp/inducing.hpp"
#include "models/gp/predictor.hpp"
#include "models/gp/regression.hpp"
#include "models/gp/synthetic.hpp"
#include "tests/support/allocations.hpp"

namespace posed::test_mixture {
namespace {

constexpr int kFunctions = 4;

struct Case {
  gp::Trained first;
  std::vector<gp::Function> more;
  Eigen::MatrixXd queries;
};

Case make_case(int poses, int dims) {
  gp::SyntheticProcess made = gp::synthetic(poses, dims);
  Case found{made.process, {}, made.queries};
  for (int f = 1; f < kFunctions; ++f) {
    const auto& weights = made.process.weights;
    const Eigen::Index turned = f * dims / kFunctions;
    gp::Function other{weights, made.process.offset * (1.0 - f)};
    other.weights.leftCols(dims - turned) = weights.rightCols(dims - turned);
    other.weights.rightCols(turned) = weights.leftCols(turned);
    found.more.push_back(std::move(other));
  }
  return found;
}

std::vector<float> query(const Case& made, Eigen::Index i) {
  const Eigen::VectorXf q = made.queries.row(i).transpose().cast<float>();
  return {q.begin(), q.end()};
}

std::vector<float> answer(const gp::Predictor& predictor, const std::vector<float>& q,
                          std::span<const float> shares = {}) {
  std::vector<float> out(static_cast<std::size_t>(predictor.outputs()));
  predictor.mean(q, {}, out, shares);
  return out;
}

void settle(gp::Predictor& predictor, std::span<const float> shares) {
  for (int i = 1; i < gp::Predictor::kSettleCalls; ++i) {
    if (predictor.settle(shares)) return;
  }
  REQUIRE(predictor.settle(shares));
}

double apart(const std::vector<float>& a, const std::vector<float>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::max(most, std::abs(double{a[i]} - double{b[i]}));
  return most;
}

}  // namespace

TEST_CASE("a mixture is the sum of its functions, on its way and at rest", "[gp][predictor]") {
  std::mt19937 random(3);
  for (const auto& [poses, dims] : {std::pair{200, 63}, {56, 43}, {65, 17}, {1, 3}, {130, 288}}) {
    const Case made = make_case(poses, dims);
    auto predictor = gp::Predictor::build(made.first, made.more).value();
    CHECK(predictor.functions() == kFunctions);
    for (int round = 0; round < 8; ++round) {
      std::array<float, kFunctions> shares{};
      for (float& share : shares) share = static_cast<float>(random() % 5) / 4.0F;
      const std::vector<float> q = query(made, round);
      gp::Trained sum = made.first;
      sum.weights *= shares[0];
      sum.offset *= shares[0];
      for (std::size_t f = 1; f < kFunctions; ++f) {
        sum.weights += shares[f] * made.more[f - 1].weights;
        sum.offset += shares[f] * made.more[f - 1].offset;
      }
      const auto wanted = answer(gp::Predictor::build(sum).value(), q);
      CHECK(apart(answer(predictor, q, shares), wanted) < 2e-5);
      settle(predictor, shares);
      CHECK(apart(answer(predictor, q), wanted) < 2e-5);
      CHECK(apart(answer(predictor, q, shares), answer(predictor, q)) < 2e-5);
      std::vector<float> constant(static_cast<std::size_t>(dims));
      predictor.constant(shares, constant);
      CHECK(apart(constant, {predictor.constant().begin(), predictor.constant().end()}) == 0.0);
    }
  }
}

TEST_CASE("one function alone gives the bits of its own predictor", "[gp][predictor]") {
  const Case made = make_case(200, 63);
  auto predictor = gp::Predictor::build(made.first, made.more).value();
  for (std::size_t f = 0; f < kFunctions; ++f) {
    gp::Trained own = made.first;
    if (f > 0) own.weights = made.more[f - 1].weights;
    if (f > 0) own.offset = made.more[f - 1].offset;
    const auto alone = gp::Predictor::build(own).value();
    std::array<float, kFunctions> shares{};
    shares[f] = 1.0F;
    const std::vector<float> q = query(made, 7);
    CHECK(answer(predictor, q, shares) == answer(alone, q));
    settle(predictor, shares);
    CHECK(answer(predictor, q) == answer(alone, q));
  }
}

TEST_CASE("a mixture is put together in bounded steps, without allocation", "[gp][predictor]") {
  const Case made = make_case(200, 63);
  auto predictor = gp::Predictor::build(made.first, made.more).value();
  const std::array<float, kFunctions> shares{0.25F, 0.25F, 0.5F, 0.0F};
  const std::uint64_t before = test::allocations();
  int calls = 1;
  while (!predictor.settle(shares)) ++calls;
  CHECK(test::allocations() == before);
  CHECK(calls > gp::Predictor::kSettleCalls / 2);
  CHECK(calls <= gp::Predictor::kSettleCalls);
  CHECK(predictor.settle(shares));
}

TEST_CASE("functions that do not fit the process are refused", "[gp][predictor]") {
  Case made = make_case(20, 5);
  made.more[1].weights.conservativeResize(19, 5);
  CHECK_FALSE(gp::Predictor::build(made.first, made.more));
  made = make_case(20, 5);
  made.more[2].offset.conservativeResize(4);
  CHECK_FALSE(gp::Predictor::build(made.first, made.more));
  made = make_case(20, 5);
  made.more.resize(gp::kMaxFunctions, made.more[0]);
  CHECK_FALSE(gp::Predictor::build(made.first, made.more));
}

TEST_CASE("functions learnt on shared poses are those learnt alone", "[gp]") {
  const gp::SyntheticProcess made = gp::synthetic(120, 21);
  const Eigen::MatrixXd& X = made.process.inputs;
  const Eigen::MatrixXd Y = (2.0 * X).array().sin();
  const gp::Hyper hyper{0.0, std::log(made.process.mu), -INFINITY, std::log(1e-2)};
  std::vector<int> first(80);
  std::vector<int> second;
  for (int i = 0; i < 80; ++i) first[static_cast<std::size_t>(i)] = i;
  for (int i = 40; i < 120; ++i) second.push_back(i);
  const std::vector<gp::FunctionData> data{
      {first, Y(first, Eigen::all), Eigen::VectorXd::Zero(21)},
      {second, -Y(second, Eigen::all), Eigen::VectorXd::Constant(21, 0.1)}};
  const auto learnt = gp::fit_functions(X, data, hyper, 120).value();
  for (std::size_t f = 0; f < data.size(); ++f) {
    const auto alone =
        gp::fit(X(data[f].rows, Eigen::all), data[f].Y, data[f].offset, hyper).value();
    const Eigen::MatrixXd apart =
        gp::posterior_mean(learnt[f], made.queries) - gp::posterior_mean(alone, made.queries);
    CHECK(apart.cwiseAbs().maxCoeff() < 1e-3);
  }
}

}  // namespace posed::test_mixture
