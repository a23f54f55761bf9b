// Phases and differences between people on six real walks of six people (CMU, 120 Hz, learnt from
// at 30): the phases that the MGPM finds, and the accuracy of a difference on a walker who is not
// in the training.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "models/style/dataset.hpp"
#include "models/style/difference.hpp"
#include "models/style/harmonics.hpp"
#include "models/style/training_pairs.hpp"
#include "tests/support/shared.hpp"

using namespace posed;
using Eigen::MatrixXd;

namespace {

constexpr std::array kWalks{"02_02", "08_01", "16_15", "35_01", "39_01", "07_01"};
constexpr std::array kPeriods{29.5, 30.1, 35.0, 33.7, 31.1, 32.4};  // frames at 30 Hz
constexpr double kPersonNoise = 0.1;  // of the signal variance, as in training with several people

bool cmu_recorded() { return test::shared("data/cmu/02_02.amc").has_value(); }

// The six walks, each with the phase from its own legs only.
style::Dataset walks() {
  std::vector<style::TrainingClip> clips;
  for (const auto* name : kWalks) {
    const auto path = test::shared(std::string("data/cmu/") + name + ".amc");
    REQUIRE(path);
    clips.push_back({clip::read_clip(*path).value(), "people", name, "walk"});
  }
  style::DatasetOptions options;
  options.space = motion::Space::kCmu43;
  return style::make_dataset(clips, "nobody", options).value();
}

// The walks in common phase, from one start of the MGPM.
style::Dataset aligned(style::MgpmStart start, std::uint64_t seed) {
  style::Dataset dataset = walks();
  style::DatasetOptions options;
  options.space = motion::Space::kCmu43;
  options.starts = {start};
  options.seed = seed;
  REQUIRE(style::align(dataset, options));
  return dataset;
}

// Training pairs from everybody except these: `delta` at the poses of each person's own cycle.
std::vector<style::Pairing> pairs_without(const std::vector<style::SubjectCycle>& cycles,
                                          const MatrixXd& delta, const std::vector<int>& without) {
  std::vector<style::Pairing> training_pairs;
  for (int s = 0; s < std::ssize(cycles); ++s) {
    if (std::ranges::find(without, s) != without.end()) continue;
    training_pairs.push_back({cycles[static_cast<std::size_t>(s)].coefficients, delta, true});
  }
  return training_pairs;
}

// The held-out person: their own frames, and the true difference at their phases.
style::Fold fold_of(const style::Dataset& dataset, std::vector<style::Pairing> train,
                    const MatrixXd& delta, int person) {
  const style::AlignedClip& clip = dataset.clips[static_cast<std::size_t>(person)];
  return {std::move(train), clip.q,
          style::harmonic_basis(clip.phase(), style::kCycleHarmonics) * delta};
}

// Mean squared errors per value, summed over the folds.
struct Errors {
  double process = 0.0, constant = 0.0, paper = 0.0, truth = 0.0;

  [[nodiscard]] double of_process() const { return std::sqrt(process / truth); }
  [[nodiscard]] double of_constant() const { return std::sqrt(constant / truth); }
  [[nodiscard]] double of_paper() const { return std::sqrt(paper / truth); }
};

// The method of Sato et al. on the same fold: one training pair at the mean cycle of the training
// people, kernel values by evidence.
double paper_error(const style::Fold& fold) {
  MatrixXd mean = MatrixXd::Zero(fold.train.front().input.rows(), fold.q.cols());
  for (const style::Pairing& pairing : fold.train) mean += pairing.input;
  mean /= static_cast<double>(fold.train.size());
  const MatrixXd basis =
      style::harmonic_basis(style::cycle_phases(style::kGridFrames), style::kCycleHarmonics);
  const auto process = style::fit_paper(basis * mean, basis * fold.train.front().delta);
  REQUIRE(process);
  return (gp::posterior(*process, fold.q).mean - fold.truth).squaredNorm();
}

// Person a's cycle minus person b's, trained on the others without `asked`, and evaluated on
// `asked`. The kernel's length is chosen by leaving out each training person in turn.
void ask(const style::Dataset& dataset, const std::vector<style::SubjectCycle>& cycles, int a,
         int b, int asked, Errors& errors) {
  const MatrixXd delta = cycles[static_cast<std::size_t>(a)].coefficients -
                         cycles[static_cast<std::size_t>(b)].coefficients;
  std::vector<style::Fold> folds;
  for (int s = 0; s < std::ssize(cycles); ++s) {
    if (s == a || s == b || s == asked) continue;
    folds.push_back(fold_of(dataset, pairs_without(cycles, delta, {a, b, asked, s}), delta, s));
  }
  const auto candidates = style::candidate_lengths_rad(dataset.dims());
  const double length_rad =
      style::choose_length_rad(folds, candidates, kPersonNoise, candidates[2]).length_rad;
  const auto fold = fold_of(dataset, pairs_without(cycles, delta, {a, b, asked}), delta, asked);
  const auto values = static_cast<double>(fold.truth.size());
  const auto found = style::fold_error(fold, length_rad, kPersonNoise);
  errors.process += found.error / values;
  errors.truth += found.truth / values;
  errors.paper += paper_error(fold) / values;
  errors.constant += (fold.truth.rowwise() - delta.row(0)).squaredNorm() / values;
}

// For every ordered pair of people and every third person held out.
Errors left_out_errors(const style::Dataset& dataset) {
  const auto cycles = style::subject_cycles(dataset);
  const int people = static_cast<int>(std::ssize(cycles));
  Errors errors;
  for (int a = 0; a < people; ++a) {
    for (int b = a + 1; b < people; ++b) {
      for (int asked = 0; asked < people; ++asked) {
        if (asked != a && asked != b) ask(dataset, cycles, a, b, asked, errors);
      }
    }
  }
  return errors;
}

}  // namespace

TEST_CASE("on six real walks four random starts of the MGPM end at one optimum, with the strides",
          "[mgpm][real]") {
  if (!cmu_recorded()) SKIP_WITHOUT_SHARED();
  double first = 0.0;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const auto dataset = aligned(style::MgpmStart::kRandom, seed);
    CHECK(dataset.clips.front().state.cols() == 89);
    const double nlp = dataset.fits.front().nlp;
    if (seed == 1U) first = nlp;
    INFO("seed " << seed << ", negative log posterior " << nlp);
    CHECK(std::abs(nlp - first) <= 1e-4 * std::abs(first));
    for (std::size_t c = 0; c < kWalks.size(); ++c) {
      INFO(kWalks[c]);
      CHECK(2.0 * std::numbers::pi / dataset.clips[c].dtheta == Approx(kPeriods[c]).epsilon(0.01));
    }
  }
}

// The README's figure is for the MGPM's own phases, so the test checks those. Training then shifts
// each clip's phase to its legs, which gives a different difference of the same two people; that
// figure is printed, too.
TEST_CASE("the difference of two people is valid for a third who is not in the training",
          "[style][real]") {
  if (!cmu_recorded()) SKIP_WITHOUT_SHARED();
  auto dataset = aligned(style::MgpmStart::kSvd, 0);
  const Errors by_legs = left_out_errors(dataset);
  for (std::size_t c = 0; c < dataset.clips.size(); ++c) {
    dataset.clips[c].theta0 = dataset.fits.front().params.theta0[static_cast<Eigen::Index>(c)];
  }
  const Errors errors = left_out_errors(dataset);
  const auto row = [](const Errors& e) {
    return "default " + std::to_string(e.of_process()) + ", paper mode " +
           std::to_string(e.of_paper()) + ", constant mean difference " +
           std::to_string(e.of_constant());
  };
  WARN("person left out, phases of the MGPM: " << row(errors)
                                               << "\nturned to the legs: " << row(by_legs));
  CHECK(errors.of_process() <= 0.23);
  CHECK(errors.of_process() < errors.of_constant());
  CHECK(errors.of_process() < errors.of_paper());
}
