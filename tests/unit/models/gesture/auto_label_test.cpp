// Compares proposed borders with the true ones, from two labelled examples of each label.
#include <catch2/catch.hpp>

#include <cmath>
#include <iostream>
#include <map>

#include "models/gesture/auto_label.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "tests/support/real_pose_corpus.hpp"
#include "tests/support/shared.hpp"

using namespace posed;
using namespace posed::gesture;

namespace {

// The first `each` segments of every label, without the very first segment, whose move is cut off.
Recording with_examples(Recording recording, int each) {
  std::map<std::string, int> taken;
  std::vector<Segment> examples;
  for (std::size_t i = 1; i < recording.segments.size(); ++i) {
    if (taken[recording.segments[i].label]++ < each) examples.push_back(recording.segments[i]);
  }
  recording.segments = std::move(examples);
  return recording;
}

// The share of true borders (starts but the first) with a proposed start of the same label within
// 150 ms.
double share_found(const Recording& truth, const std::vector<Segment>& proposed) {
  int found = 0;
  for (std::size_t i = 1; i < truth.segments.size(); ++i) {
    const Segment& wanted = truth.segments[i];
    found += std::ranges::any_of(proposed, [&](const Segment& s) {
      return s.label == wanted.label && std::abs(s.begin - wanted.begin) <= 0.150 * truth.rate_hz;
    });
  }
  return found / static_cast<double>(truth.segments.size() - 1);
}

void check_valid(const Recording& recording, const std::vector<Segment>& proposed) {
  for (std::size_t i = 0; i < proposed.size(); ++i) {
    CHECK(proposed[i].frames() >= 1);
    if (i > 0) CHECK(proposed[i].begin >= proposed[i - 1].end);
  }
  CHECK(proposed.back().end <= recording.angles_rad.rows());
  for (const Segment& example : recording.segments) {
    CHECK(std::ranges::any_of(proposed, [&](const Segment& s) {
      return s.begin == example.begin && s.end == example.end && s.label == example.label;
    }));
  }
}

}  // namespace

TEST_CASE("Nine of ten borders are proposed within 150 ms on real poses", "[auto_label][real]") {
  const auto folder = test::shared("data/gloves/libras_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  for (const std::uint32_t seed : {7U, 8U, 13U}) {
    const Recording truth = test::real_pose_corpus(*folder, seed);
    const Recording few = with_examples(truth, 2);
    REQUIRE(few.segments.size() == 6);
    const auto proposed = propose_segments(few);
    REQUIRE(proposed.has_value());
    check_valid(few, *proposed);
    const double share = share_found(truth, *proposed);
    std::cout << "auto-label, seed " << seed << ": " << 100.0 * share
              << " % of borders within 150 ms, " << proposed->size() << " segments for "
              << truth.segments.size() << "\n";
    CHECK(share >= 0.9);
    CHECK(proposed->size() <= truth.segments.size() + 5);
  }
}

TEST_CASE("Where people put the border is learnt from the examples", "[auto_label]") {
  const auto performance = make_performance({.gestures = 40});
  auto truth = recording_of(performance->clip, 30.0);
  REQUIRE(cut(*truth, performance->labels, "synthetic.lab").has_value());
  for (const int late :
       {0, 7}) {  // people put the border at the start or in the middle of the move
    Recording moved = *truth;
    for (std::size_t i = 1; i < moved.segments.size(); ++i) {
      moved.segments[i].begin = moved.segments[i - 1].end = truth->segments[i].begin + late;
    }
    const Recording few = with_examples(moved, 2);
    const auto proposed = propose_segments(few);
    REQUIRE(proposed.has_value());
    check_valid(few, *proposed);
    CHECK(share_found(moved, *proposed) >= 0.9);
  }
}

TEST_CASE("Examples of one label propose nothing", "[auto_label]") {
  const auto performance = make_performance({.gestures = 4});
  auto recording = recording_of(performance->clip, 30.0);
  CHECK_FALSE(propose_segments(*recording).has_value());
  recording->segments = {{0, 40, "g"}};
  CHECK(propose_segments(*recording).error().message.find("two different poses") !=
        std::string::npos);
}
