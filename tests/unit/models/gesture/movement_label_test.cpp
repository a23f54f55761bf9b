// Takes of one movement label themselves, and clips of bodies become recordings.
#include "models/gesture/movement_label.hpp"

#include <catch2/catch.hpp>

#include "models/gesture/body_recording.hpp"
#include "tests/support/arm_raiser.hpp"

namespace posed::gesture {
namespace {

Recording raised(const test::Raise& raise) {
  const clip::Clip clip = test::raise_take(raise);
  const auto vocabulary = body_vocabulary(body_groups(*clip.skeleton));
  return body_recording(clip, raise.rate_hz, vocabulary.value()).value();
}

std::string movement_refusal(const Recording& recording) {
  const auto segments = propose_movement(recording, "raise", "rest");
  return segments ? "" : segments.error().message;
}

}  // namespace

TEST_CASE("A take of one movement is labelled at its onsets", "[movement]") {
  for (const double rate_hz : {30.0, 120.0}) {
    const Recording recording = raised({.right = true, .rate_hz = rate_hz});
    const auto segments = propose_movement(recording, "raise", "rest");
    REQUIRE(segments.has_value());
    REQUIRE(segments->size() == 2);
    CHECK((*segments)[0].label == "raise");
    CHECK((*segments)[1].label == "rest");
    CHECK((*segments)[1].begin == (*segments)[0].end);
    CHECK((*segments)[1].end == recording.angles_rad.rows());
    // The arm sets off at 0.2 s, and down again half a second and the way before the end.
    CHECK((*segments)[0].begin / rate_hz == Approx(0.2).margin(0.12));
    const double down_s = static_cast<double>(recording.angles_rad.rows()) / rate_hz - 1.2;
    CHECK((*segments)[0].end / rate_hz == Approx(down_s).margin(0.12));
  }
}

TEST_CASE("A hold is cut so that it can be performed for as long as one likes", "[movement]") {
  for (const double rate_hz : {30.0, 120.0}) {
    const Recording wave = raised({.right = true, .wave = true, .rate_hz = rate_hz});
    const auto whole = propose_movement(wave, "wave", "rest").value();
    const auto segments = propose_movement(wave, "wave", "rest", Hold::kCycles).value();
    REQUIRE(segments.size() > 5);
    CHECK(segments.front().begin == whole.front().begin);
    CHECK(segments.back().begin == whole.back().begin);
    for (std::size_t i = 1; i + 1 < segments.size(); ++i) {
      CHECK(segments[i].label == "wave");
      CHECK(segments[i].begin == segments[i - 1].end);
      const bool last = i + 2 == segments.size();
      if (!last) CHECK(segments[i].frames() / rate_hz == Approx(1.0 / test::kWave_hz).margin(0.05));
    }
    // A still hold is cut in its middle.
    const auto raise = propose_movement(raised({.right = true, .rate_hz = rate_hz}), "raise",
                                        "rest", Hold::kCycles);
    REQUIRE(raise->size() == 3);
    CHECK((*raise)[1].label == "raise");
    CHECK((*raise)[1].frames() / rate_hz == Approx(0.42).margin(0.15));
  }
}

TEST_CASE("Takes that are not one movement are refused", "[movement]") {
  CHECK(movement_refusal(raised({})).find("nothing moves") == 0);
  Recording half = raised({.left = true});
  half.angles_rad.conservativeResize(half.angles_rad.rows() / 2, Eigen::NoChange);
  CHECK(movement_refusal(half).find("the take ends away from where it began") == 0);
}

TEST_CASE("A body's clips become rotation vectors about their mean", "[movement]") {
  const std::vector<clip::Clip> clips{test::raise_take({.left = true}),
                                      test::raise_take({.right = true, .rate_hz = 120.0})};
  Vocabulary vocabulary = body_vocabulary(body_groups(*clips[0].skeleton)).value();
  const auto recordings = body_recordings(clips, 30.0, vocabulary);
  REQUIRE(recordings.has_value());
  CHECK(recordings->front().angles_rad.cols() == vocabulary.channels());
  CHECK(recordings->back().rate_hz == 30.0);
  const auto seconds = static_cast<double>(clips[1].frames()) / 120.0;
  CHECK(recordings->back().angles_rad.rows() == Approx(30.0 * seconds).margin(2.0));
  clip::Clip lame = clips[0];
  auto skeleton = std::make_shared<Skeleton>(*lame.skeleton);
  for (Joint& joint : skeleton->joints) {
    if (joint.bone == Bone::kLeftFoot) joint.bone.reset();
  }
  lame.skeleton = skeleton;
  const auto refused = body_recordings({clips[0], lame}, 30.0, vocabulary);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("the skeleton has no leftFoot") == 0);
  clip::Clip brief = clips[0];
  brief.channels.conservativeResize(4, Eigen::NoChange);
  CHECK_FALSE(body_recording(brief, 30.0, vocabulary).has_value());
}

}  // namespace posed::gesture
