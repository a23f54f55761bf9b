// The choice of the kernel: folds in several tasks, and progress when lengths are added.
#include "models/style/train/kernel_choice.hpp"

#include <catch2/catch.hpp>

#include <random>

#include "models/style/model/harmonics.hpp"

using namespace posed;

namespace {

constexpr int kDims = 6;
constexpr int kWalkers = 5;

Eigen::MatrixXd some_cycle(std::mt19937& bits) {
  std::normal_distribution<double> normal(0.0, 0.3);
  return Eigen::MatrixXd::NullaryExpr(2 * style::kCycleHarmonics + 1, kDims,
                                      [&] { return normal(bits); });
}

struct Walkers {
  style::TrainingPairs pairs;
  std::vector<style::Fold> folds;

  [[nodiscard]] style::LeaveOut leave_out() const {
    return {pairs, folds.size(), [this](std::size_t index) { return folds[index]; }};
  }
};

// Walkers with unrelated cycles and differences; each fold asks for one of them without it.
Walkers walkers() {
  std::mt19937 bits(3);
  Walkers found;
  auto& inputs = found.pairs.inputs;
  auto& outputs = found.pairs.outputs;
  outputs.offset = Eigen::RowVectorXd::Constant(kDims, 0.1);
  for (int w = 0; w < kWalkers; ++w) {
    inputs.push_back(some_cycle(bits));
    outputs.differences.push_back(some_cycle(bits));
    outputs.of_input.push_back(w);
  }
  for (int w = 0; w < kWalkers; ++w) {
    const auto& own = inputs[static_cast<std::size_t>(w)];
    style::Fold fold;
    fold.left_out = {w};
    fold.outputs = outputs;
    fold.truth = outputs.differences[static_cast<std::size_t>(w)];
    fold.phase = style::cycle_phases(30);
    fold.q = style::harmonic_basis(fold.phase, style::kCycleHarmonics) * own;
    fold.goal = own + fold.truth;
    found.folds.push_back(fold);
  }
  return found;
}

// More folds than one task takes.
Walkers thrice(const Walkers& once) {
  Walkers found = once;
  for (int more = 0; more < 2; ++more) {
    found.folds.insert(found.folds.end(), once.folds.begin(), once.folds.end());
  }
  return found;
}

}  // namespace

TEST_CASE("folds count alike in one task and in several", "[style][people]") {
  const Walkers once = walkers();
  const Walkers thrice_as_many = thrice(once);
  SerialTasks tasks;
  const auto few = style::choose_kernel(once.leave_out(), tasks, {}).value();
  const auto many = style::choose_kernel(thrice_as_many.leave_out(), tasks, {}).value();
  CHECK(many.kernel.length_rad == few.kernel.length_rad);
  CHECK(many.kernel.noise == few.kernel.noise);
  CHECK(many.error == Approx(few.error));
  CHECK(many.way(0).before == Approx(3.0 * few.way(0).before));
  CHECK(many.way(0).after == Approx(3.0 * few.way(0).after));
}

TEST_CASE("progress never goes back when lengths are added", "[style][people]") {
  Walkers far = thrice(walkers());
  for (style::Fold& fold : far.folds) {
    // Far from all poses, where the truth is the prior mean: the shorter the better.
    fold.q.array() += 0.5;
    fold.truth.setZero();
    fold.truth.row(0) = fold.outputs.offset;
  }
  double last = 0.0;
  int reported = 0;
  SerialTasks tasks;
  const auto chosen = style::choose_kernel(far.leave_out(), tasks, [&](double fraction) {
    CHECK(fraction >= last);
    CHECK(fraction <= 1.0);
    last = fraction;
    ++reported;
    return true;
  });
  REQUIRE(chosen);
  CHECK(reported == 2 * (4 + 1 + 1));  // two tasks a length: four first ones, 20 and 13 degrees
}
