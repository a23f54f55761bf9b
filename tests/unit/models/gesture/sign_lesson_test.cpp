// Signs that are shown three times each are recognised and performed; shows of which nothing can be
// learnt are refused in words.
#include "models/gesture/sign_lesson.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include <catch2/catch.hpp>

#include "models/gesture/model_file.hpp"
#include "models/gesture/pose_distance.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/perform/perform.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/has.hpp"
#include "tests/support/live_hand.hpp"

namespace posed::gesture {
namespace {

using test::has;

// From an open hand into the sign and back.
clip::HandClip show_of(const std::string& sign, std::uint32_t person = 1) {
  return make_performance({.person = person, .script = {"p", sign, "p"}}).value().clip;
}

std::string why_not(SignLesson& lesson, const std::string& label, clip::HandClip show) {
  const auto added = lesson.add(label, std::move(show));
  return added ? "added: " + *added : added.error().message;
}

SignLesson lesson_of(const std::vector<std::string>& signs) {
  SignLesson lesson;
  for (const std::string& sign : signs) {
    for (std::uint32_t person = 1; person <= kMinShows; ++person) {
      const auto added = lesson.add(sign, show_of(sign, person));
      INFO((added ? *added : added.error().message));
      REQUIRE(added);
    }
  }
  return lesson;
}

const std::function<bool()> kGoOn = [] { return true; };

}  // namespace

TEST_CASE("signs that were shown three times are recognised, and performed as shown", "[teach]") {
  const SignLesson lesson = lesson_of({"1", "g"});
  const auto learnt = lesson.train(kGoOn);
  REQUIRE(learnt);
  CHECK(has(learnt->verdict, "knows 1, g, rest from 6 shows"));
  const auto model = parse_model(std::as_bytes(std::span(learnt->bytes)), "taught").value();
  REQUIRE(model.held);

  // A take of another day.
  const auto live = smooth::bind_live_model(model, hand_skeleton(Side::kRight), "taught").value();
  for (const std::string sign : {"1", "g"}) {
    const auto take = make_performance({.person = 9, .script = {"p", sign, "p"}}).value();
    auto truth = recording_of(take.clip, 30.0).value();
    REQUIRE(cut(truth, take.labels, "take"));
    const auto seen =
        test::followed(truth.angles_rad / kDegree, 30.0, test::live_options(1, 0.3), live.get());
    const Segment held = held_part(truth.segments[1]);
    for (int t = held.begin; t < held.end; ++t) {
      INFO(sign << " in frame " << t);
      CHECK(seen.label[static_cast<std::size_t>(t)] == sign);
    }
    CHECK(seen.label.back() == kRest);
  }

  const trajectory::StateInformation states(std::make_shared<const GestureModel>(model), 30.0);
  const std::vector<int> order = perform::labels_of(model, "rest 1 rest").value();
  const auto performed = perform::perform(states, order, {}).value();
  const auto& shown = model.labels[static_cast<std::size_t>(order[1])].shown;
  double nearest = std::numeric_limits<double>::infinity();
  for (const perform::Pose& pose : performed.angles) {
    nearest = std::min(nearest, apart(model, pose, shown).rms_rad());
  }
  CHECK(nearest < 2.0 * kDegree);
}

TEST_CASE("a show of which no sign can be learnt is refused in words", "[teach]") {
  SignLesson lesson = lesson_of({"1"});
  CHECK(has(why_not(lesson, "still", show_of("p")), "nothing moves"));
  CHECK(has(why_not(lesson, "one", show_of("1", 5)), "this is like '1'"));
  CHECK(has(why_not(lesson, "1", show_of("g")), "not '1' as it was shown before ... finger"));

  clip::HandClip holes = show_of("g");
  for (std::size_t t = 0; t < holes.angles.size(); t += 4) {
    holes.angles[t].front() = std::numeric_limits<double>::quiet_NaN();
  }
  CHECK(has(why_not(lesson, "g", holes), "values are missing in"));
  clip::HandClip wave = show_of("g");
  for (std::size_t t = 0; t < wave.angles.size(); ++t) {
    for (double& angle : wave.angles[t]) {
      angle += 25.0 * kDegree * std::sin(0.9 * static_cast<double>(t));
    }
  }
  CHECK(has(why_not(lesson, "g", wave), "moved too much"));
  clip::HandClip jumps = show_of("g");  // as a camera sees a hand
  for (std::size_t t = 4; t < jumps.angles.size(); t += 10) {
    for (double& angle : jumps.angles[t]) angle += 60.0 * kDegree;
  }
  CHECK(SignLesson().add("g", jumps));
  clip::HandClip stays = show_of("g");
  const std::size_t half = stays.angles.size() / 2;
  stays.angles.resize(half);
  stays.time_s.resize(half);
  CHECK(has(why_not(lesson, "g", stays), "ends away from where it began"));
  clip::HandClip gap = show_of("g");
  for (std::size_t t = half; t < gap.time_s.size(); ++t) gap.time_s[t] += 1.0;
  CHECK(has(why_not(lesson, "g", gap), "no frames came for 1.0 s"));

  for (const std::string name : {"", "two words", "rest", "none", "a_name_of_16_sig"}) {
    CHECK_FALSE(lesson.check_label(name));
  }
  REQUIRE(lesson.add("g", show_of("g")));
  CHECK(has(lesson.train(kGoOn).error().message, "'g' needs 3 good shows and has 1"));
  lesson.forget("g");
  CHECK(lesson.train(kGoOn));
  CHECK_FALSE(lesson.train([] { return false; }));
}

}  // namespace posed::gesture
