// Whole label sequences: their states, the look-ahead against the full solve, gestures that were
// not recorded, global variance.
#include "models/perform/perform.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/gesture/train.hpp"
#include "models/perform/constrain.hpp"
#include "models/random.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/real_pose_corpus.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"
#include "tests/unit/models/perform/lookahead_corpus.hpp"

using namespace posed;
using perform::Performance;
using trajectory::StateInformation;

namespace {

StateInformation information_of(gesture::GestureModel model) {
  const double rate_hz = model.rate_hz;
  return {std::make_shared<const gesture::GestureModel>(std::move(model)), rate_hz};
}

Performance performed(const StateInformation& information, const std::string& text,
                      const perform::PerformOptions& options = {}) {
  const auto labels = perform::labels_of(information.model(), text);
  REQUIRE(labels.has_value());
  return perform::perform(information, *labels, options).value();
}

double rms_apart_deg(const Performance& a, const Performance& b) {
  REQUIRE(a.angles.size() == b.angles.size());
  double sum = 0.0;
  for (std::size_t t = 0; t < a.angles.size(); ++t) {
    for (int c = 0; c < kHandChannels; ++c) sum += std::pow(a.angles[t][c] - b.angles[t][c], 2);
  }
  return std::sqrt(sum / static_cast<double>(a.angles.size() * kHandChannels)) / kDegree;
}

double jerk_deg(const Performance& p) {
  double sum = 0.0;
  for (std::size_t t = 3; t < p.angles.size(); ++t) {
    for (int c = 0; c < kHandChannels; ++c) {
      sum += std::pow(
          p.angles[t][c] - 3.0 * p.angles[t - 1][c] + 3.0 * p.angles[t - 2][c] - p.angles[t - 3][c],
          2);
    }
  }
  return std::sqrt(sum / static_cast<double>((p.angles.size() - 3) * kHandChannels)) / kDegree;
}

// Mean over states 3 and 4 of a label against real poses: rms over the flexion angles without the
// thumb.
double held_off_deg(const Performance& p, int label, const Eigen::VectorXd& real) {
  Eigen::VectorXd held = Eigen::VectorXd::Zero(kHandChannels);
  int frames = 0;
  for (const auto& state : p.states) {
    if (state.context.current != label || (state.state != 2 && state.state != 3)) continue;
    for (int t = state.start; t < state.start + state.frames; ++t, ++frames) {
      held += Eigen::Map<const Eigen::VectorXd>(p.angles[t].data(), kHandChannels);
    }
  }
  REQUIRE(frames > 0);
  held /= frames;
  double sum = 0.0;
  for (int f = 1; f < kFingers; ++f) {
    for (int j = 0; j < kFingerJoints; ++j) {
      const int c = f * kFingerChannels + 3 * j;
      sum += std::pow(held[c] - real[c], 2);
    }
  }
  return std::sqrt(sum / 12.0) / kDegree;
}

}  // namespace

TEST_CASE("A performance that would not fit the memory is refused in one sentence", "[perform]") {
  gesture::GestureModel model = test::toy_gesture_model();
  for (auto& leaf : model.durations.leaves) leaf.mean.fill(gesture::kMaxState_s * model.rate_hz);
  const auto information = information_of(std::move(model));
  const std::vector<int> labels(100, 0);
  const auto refused = perform::perform(information, labels, {});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("the 100 labels last more than") == 0);
}

TEST_CASE("The longest gesture is performed", "[perform]") {
  gesture::GestureModel model = test::toy_gesture_model();
  model.rate_hz = 10.0;
  for (auto& leaf : model.durations.leaves) leaf.mean[2] = gesture::kMaxState_s * model.rate_hz;
  const auto held = performed(information_of(std::move(model)), "g");
  CHECK(std::ssize(held.angles) > 6'000);
}

TEST_CASE("a performance lists its states, from the first frame to the last", "[generate]") {
  const auto information = information_of(test::toy_gesture_model());
  const auto p = performed(information, "g 1 c");
  REQUIRE(p.states.size() == 3 * gesture::kStates);
  int start = 0;
  for (std::size_t i = 0; i < p.states.size(); ++i) {
    CHECK(p.states[i].start == start);
    CHECK(p.states[i].state == static_cast<int>(i) % gesture::kStates);
    start += p.states[i].frames;
  }
  CHECK(start == static_cast<int>(p.angles.size()));
  CHECK(p.variances.size() == p.angles.size());
  CHECK(p.states[7].leaf[0] == 0);  // label 1: the thumb as in g, the index as in p
  CHECK(p.states[7].leaf[1] == 2);
}

TEST_CASE("empty sequences and unknown labels are refused by name", "[generate]") {
  const auto model = test::toy_gesture_model();
  const auto unknown = perform::labels_of(model, "g 2 c five");
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().message.find("2 five") != std::string::npos);
  CHECK(unknown.error().message.find("g c p 1 3 4") != std::string::npos);
  CHECK(unknown.error().exit_code == ExitCode::kWrongUse);
  CHECK_FALSE(perform::labels_of(model, "  "));
}

// The figures of models/trajectory/README.md, "Look-ahead"; corpora differ by a
// factor of two, so ten are used.
TEST_CASE("a look-ahead of 15 or 20 frames is nearly the full solve", "[generate]") {
  constexpr int kCorpora = 10;
  double at_15_deg = 0.0;
  double at_20_deg = 0.0;
  double jerk_ratio = 0.0;
  for (std::uint32_t seed = 0; seed < kCorpora; ++seed) {
    auto model = gesture::train_gesture({test::study_corpus(seed)}, {});
    REQUIRE(model.has_value());
    const auto information = information_of(std::move(*model));
    const auto full = performed(information, "g 1 c 3 4 p");
    const auto at_15 = performed(information, "g 1 c 3 4 p", {.look_ahead = 15});
    const auto at_20 = performed(information, "g 1 c 3 4 p", {.look_ahead = 20});
    std::cout << "look-ahead, corpus " << seed << ": " << full.angles.size()
              << " frames, rms at 15 " << rms_apart_deg(at_15, full) << ", at 20 "
              << rms_apart_deg(at_20, full) << " deg, jerk " << jerk_deg(at_20) / jerk_deg(full)
              << " of the full solve's\n";
    at_15_deg += rms_apart_deg(at_15, full) / kCorpora;
    at_20_deg += rms_apart_deg(at_20, full) / kCorpora;
    jerk_ratio += jerk_deg(at_20) / jerk_deg(full) / kCorpora;
    CHECK(rms_apart_deg(performed(information, "g 1 c 3 4 p", {.look_ahead = 1'000}), full) < 1e-9);
  }
  std::cout << "look-ahead, mean: " << at_15_deg << ", " << at_20_deg << " deg, jerk " << jerk_ratio
            << '\n';
  CHECK(at_15_deg <= 0.20);
  CHECK(at_20_deg <= 0.12);
  CHECK(std::abs(jerk_ratio - 1.0) <= 0.03);
}

TEST_CASE("gestures of a real hand that were not recorded are near the real ones", "[real]") {
  const auto folder = test::shared("data/gloves/libras_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  auto model = gesture::train_gesture({test::real_pose_corpus(*folder, 7)}, {});
  REQUIRE(model.has_value());
  const auto information = information_of(std::move(*model));
  const auto p = performed(information, "g 1 c 3 4 p");
  std::cout << "real-pose corpus: g 1 c 3 4 p has " << p.angles.size() << " frames";
  CHECK(std::abs(static_cast<int>(p.angles.size()) - 345) <= 40);
  const std::map<std::string, double> limits{{"1", 1.4}, {"3", 1.7}, {"4", 1.4}};
  for (const auto& [label, limit] : limits) {
    const double best_deg = test::best_composition_deg(*folder, label);
    const Eigen::VectorXd real =
        test::libras_poses(*folder, test::kSignOf.at(label)).colwise().mean();
    const double off = held_off_deg(p, information.model().label_index(label), real);
    std::cout << "; " << label << " is " << off << " deg off, " << off / best_deg
              << " of the best composition";
    CHECK(off <= limit * best_deg);
  }
  std::cout << '\n';
  for (const double tempo : {0.5, 0.75, 1.5, 2.0}) {
    const auto fast = performed(information, "g 1 c 3 4 p", {.tempo = tempo});
    const double length =
        static_cast<double>(fast.angles.size()) * tempo / static_cast<double>(p.angles.size());
    CHECK(std::abs(length - 1.0) <= 0.05);
  }
}

// The hold is the shown pose; how far that is from the sign's mean is the floor.
TEST_CASE("a gesture that was shown once is held as it was shown", "[real]") {
  const auto folder = test::shared("data/gloves/libras_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  constexpr std::uint32_t kFirst = 20, kCorpora = 4;
  constexpr std::size_t kMaxShown = 5;               // rows that are shown
  std::map<std::string, std::array<double, 4>> off;  // composed, once, five times, the floor
  double jerk = 0.0, jerk_composed = 0.0;
  for (std::uint32_t seed = kFirst; seed < kFirst + kCorpora; ++seed) {
    auto model = gesture::train_gesture({test::real_pose_corpus(*folder, seed)}, {});
    REQUIRE(model.has_value());
    const auto composed = performed(information_of(*model), "g 1 c 3 4 p");
    PortableRandom random(seed);
    std::map<std::string, Eigen::MatrixXd> shown;
    for (const char* const label : {"1", "3", "4"}) {
      const auto poses = test::libras_poses(*folder, test::kSignOf.at(label));
      Eigen::MatrixXd& rows = shown[label];
      rows.resize(kMaxShown, kHandChannels);
      for (std::size_t i = 0; i < kMaxShown; ++i) {
        rows.row(static_cast<Eigen::Index>(i)) =
            poses.row(random.below(static_cast<int>(poses.rows())));
      }
    }
    for (const std::size_t count : {std::size_t{1}, kMaxShown}) {
      for (gesture::Label& label : model->labels) {
        if (!shown.contains(label.name)) continue;
        label.shown.clear();
        for (Eigen::Index c = 0; c < kHandChannels; ++c) {
          std::vector<double> column;
          for (std::size_t i = 0; i < count; ++i) {
            column.push_back(shown[label.name](static_cast<Eigen::Index>(i), c));
          }
          std::ranges::sort(column);
          label.shown.push_back(column[count / 2]);
        }
      }
      const auto p = performed(information_of(*model), "g 1 c 3 4 p");
      CHECK(p.angles.size() == composed.angles.size());
      const int three = model->label_index("3");
      const auto& pose = model->labels[static_cast<std::size_t>(three)].shown;
      CHECK(held_off_deg(performed(information_of(*model), "g 3 p 3 c 3 g"), three,
                         Eigen::Map<const Eigen::VectorXd>(pose.data(), std::ssize(pose))) < 1.5);
      jerk += jerk_deg(p);
      jerk_composed += jerk_deg(composed);
      for (auto& [name, rows] : shown) {
        const int label = model->label_index(name);
        const Eigen::VectorXd real =
            test::libras_poses(*folder, test::kSignOf.at(name)).colwise().mean();
        Performance as_shown = p;  // every frame the shown pose
        as_shown.angles.assign(p.angles.size(),
                               model->labels[static_cast<std::size_t>(label)].shown);
        off[name][0] += held_off_deg(composed, label, real) / (2 * kCorpora);
        off[name][count == 1 ? 1 : 2] += held_off_deg(p, label, real) / kCorpora;
        if (count == 1) off[name][3] += held_off_deg(as_shown, label, real) / kCorpora;
      }
    }
  }
  for (const auto& [name, deg] : off) {
    std::cout << name << ": composed " << deg[0] << ", shown once " << deg[1] << ", five times "
              << deg[2] << ", the shown pose itself " << deg[3] << " deg off\n";
    CHECK(deg[1] < 1.1 * deg[3] + 1.5);
    CHECK(deg[1] < 0.7 * deg[0]);
    CHECK(deg[2] < 4.5);
  }
  std::cout << "jerk " << jerk / jerk_composed << " of the composed one's\n";
  CHECK(jerk < 1.15 * jerk_composed);
}

// `posed_bench generate` runs all 1,296 sequences of four labels.
TEST_CASE("no finger goes through another in sequences of a real hand's gestures", "[real]") {
  const auto folder = test::shared("data/gloves/libras_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  auto model = gesture::train_gesture({test::real_pose_corpus(*folder, 7)}, {});
  REQUIRE(model.has_value());
  const auto information = information_of(std::move(*model));
  double before_m = 1.0;
  for (const char* text : {"g 1 c 3", "4 p 3 c", "c 4 g p", "p 1 4 3", "3 3 1 c", "g p g p"}) {
    auto p = performed(information, text);
    const auto kept = perform::constrain(p, default_hand_shape());
    INFO(text);
    CHECK(kept.min_gap_m >= 0.0);
    CHECK(perform::smallest_gap_m(p, default_hand_shape()) >= 0.0);
    before_m = std::min(before_m, kept.before_m);
  }
  CHECK(before_m < 0.0);  // otherwise the test would prove nothing
}

TEST_CASE("global variance restores the range, within its limit", "[generate]") {
  auto model = gesture::train_gesture({test::study_corpus(3)}, {});
  REQUIRE(model.has_value());
  const auto information = information_of(std::move(*model));
  const auto plain = performed(information, "g p c g");
  const auto lively = performed(information, "g p c g", {.global_variance = true});
  const auto range = [](const Performance& p, int c) {
    double low = 1e9;
    double high = -1e9;
    for (const auto& pose : p.angles) low = std::min(low, pose[c]), high = std::max(high, pose[c]);
    return high - low;
  };
  for (int c = 0; c < kHandChannels; ++c) {
    CHECK(range(lively, c) >= range(plain, c) * (1.0 - 1e-12));
    CHECK(range(lively, c) <= range(plain, c) * 1.3 + 1e-12);
  }
}
