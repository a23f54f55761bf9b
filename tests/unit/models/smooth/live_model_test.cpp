// The live smoother with a gesture model (models/smooth/README.md, "Model prior"): it names the
// gesture, bridges gaps within its own gestures, steadies poses that it knows, and does not disturb
// an unknown hand.
#include <filesystem>
#include <iostream>
#include <string>

#include <catch2/catch.hpp>

#include "models/gesture/train.hpp"
#include "tests/bench/baselines.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/gaps.hpp"
#include "tests/support/last_frame.hpp"
#include "tests/support/live_hand.hpp"
#include "tests/support/real_pose_corpus.hpp"
#include "tests/support/shared.hpp"

using namespace posed;
using namespace posed::test;
using smooth::LiveOptions;

namespace {

constexpr const char* kLibras = "data/gloves/libras_cyberglove";
constexpr const char* kGraspFolder = "data/gloves/graspdb14_cyberglove";

std::unique_ptr<const smooth::LiveModel> model_of(const gesture::Recording& recording,
                                                  bool tells_none = false) {
  gesture::TrainOptions options;
  options.vocabulary.tells_none = tells_none;
  const auto model = gesture::train_gesture({recording}, options).value();
  return smooth::bind_live_model(model, hand_skeleton(Side::kRight), "toy").value();
}

const smooth::LiveModel& synthetic_model() {
  static const auto kModel = model_of(recording_of(synthetic_hand(100, 1)));
  return *kModel;
}

const smooth::LiveModel& real_pose_model() {
  static const auto kModel = model_of(real_pose_corpus(*shared(kLibras), 7));
  return *kModel;
}

// The same, and what is none of its gestures is told.
const smooth::LiveModel& model_with_none() {
  static const auto kModel = model_of(real_pose_corpus(*shared(kLibras), 7), true);
  return *kModel;
}

// The frames, of a hundred, that are none of g, c and p while poses of a sign are held: twenty real
// ones, each approached from one of sign A.
int none_percent(const std::string& sign) {
  const auto poses = libras_poses(*shared(kLibras), sign);
  const auto start = libras_poses(*shared(kLibras), "A");
  constexpr int kFrames = 90, kSetOff = 30, kHeld = 60;
  int none = 0, held = 0;
  for (Eigen::Index i = 0; i < 20; ++i) {
    Motion motion(kFrames, kHandChannels);
    for (int t = 0; t < kFrames; ++t) {
      const double u = std::clamp((t - kSetOff) / 14.0, 0.0, 1.0);
      const double way = u * u * u * (10.0 - u * (15.0 - 6.0 * u));  // minimum jerk
      motion.row(t) = (start.row(i) + way * (poses.row(i) - start.row(i))) / kDegree;
    }
    const auto reported =
        followed(noisy(motion, 1.0, 5), 30.0, live_options(1, 1.0), &model_with_none());
    for (std::size_t t = kHeld; t < kFrames - 2; ++t, ++held) {
      none += reported.label[t] == smooth::kNoneName ? 1 : 0;
    }
  }
  return 100 * none / held;
}

}  // namespace

TEST_CASE("a live hand's gestures are recognised", "[live][labels]") {
  for (const auto& [noise_deg, least] : {std::pair{1.0, 0.86}, {3.0, 0.82}, {6.0, 0.78}}) {
    LabelScore score;
    for (const unsigned seed : {123U, 5U, 77U}) {
      const SyntheticHand hand = synthetic_hand(40, seed);
      const auto reported = followed(noisy(hand.angles, noise_deg, 5), 30.0,
                                     live_options(1, noise_deg), &synthetic_model());
      score.add(reported, recording_of(hand), 1);
    }
    std::cout << "labels, synthetic hand, " << noise_deg << " deg, lag 1: " << score.accuracy()
              << " of frames right, p > 0.8 after " << score.median_delay() << " frames\n";
    CHECK(score.accuracy() >= least);
  }
}

TEST_CASE("gestures of real poses are recognised", "[live][labels]") {
  if (!shared(kLibras)) {
    SKIP_WITHOUT_SHARED();
  }
  const auto truth = real_pose_corpus(*shared(kLibras), 8, 40);
  for (const double noise_deg : {1.0, 3.0, 6.0}) {
    LabelScore score;
    const Motion measured = noisy(truth.angles_rad / kDegree, noise_deg, 5);
    score.add(followed(measured, 30.0, live_options(1, noise_deg), &real_pose_model()), truth, 1);
    std::cout << "labels, real poses, " << noise_deg << " deg, lag 1: " << score.accuracy()
              << " of frames right, p > 0.8 after " << score.median_delay() << " frames\n";
    CHECK(score.accuracy() >= 0.9);
  }
}

TEST_CASE("a hand that makes none of the gestures is told so where the model does",
          "[live][labels]") {
  if (!shared(kLibras)) {
    SKIP_WITHOUT_SHARED();
  }
  const auto truth = real_pose_corpus(*shared(kLibras), 8, 40);
  for (const double noise_deg : {1.0, 3.0, 6.0}) {
    LabelScore without, with;
    const Motion measured = noisy(truth.angles_rad / kDegree, noise_deg, 5);
    const auto options = live_options(1, noise_deg);
    without.add(followed(measured, 30.0, options, &real_pose_model()), truth, 1);
    with.add(followed(measured, 30.0, options, &model_with_none()), truth, 1);
    CHECK(with.accuracy() == without.accuracy());
  }
  // Real poses of the three signs with twice the spread that was taught (the first rows are on
  // their way from another sign), then of all others.
  for (const char* sign : {"A", "V", "4"}) {
    const int percent = none_percent(sign);
    std::cout << "sign " << sign << ", learnt: " << percent << " % of the frames none\n";
    CHECK(percent <= 25);
  }
  int others = 0, mostly_none = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*shared(kLibras))) {
    const std::string sign = entry.path().stem().string();
    if (entry.path().extension() != ".csv" || sign == "A" || sign == "V" || sign == "4") continue;
    const int percent = none_percent(sign);
    std::cout << "sign " << sign << ": " << percent << " % of the frames none\n";
    ++others;
    mostly_none += percent > 50 ? 1 : 0;
  }
  CHECK(mostly_none >= 0.95 * others);
}

TEST_CASE("poses that the model knows are steadied", "[live]") {
  const SyntheticHand hand = synthetic_hand(18, 123);
  for (const double noise_deg : {1.0, 3.0, 6.0}) {
    const Motion measured = noisy(hand.angles, noise_deg, 5);
    const auto without = followed(measured, 30.0, live_options(1, noise_deg), nullptr);
    const auto known = followed(measured, 30.0, live_options(1, noise_deg), &synthetic_model());
    CHECK(bench::rms_deg(known.angles, hand.angles) < bench::rms_deg(without.angles, hand.angles));
    CHECK(without.label[500].empty());
  }
}

TEST_CASE("dropouts within the model's vocabulary are bridged", "[live]") {
  if (!shared(kLibras)) {
    SKIP_WITHOUT_SHARED();
  }
  GapError error;
  for (const unsigned seed : {8U, 9U, 10U, 11U}) {
    const Motion truth = real_pose_corpus(*shared(kLibras), seed).angles_rad / kDegree;
    const Gaps gaps = with_gaps(noisy(truth, 1.0, 5), 8, 3);
    error.add(truth, followed(gaps.measured, 30.0, live_options(1, 1.0), &real_pose_model()).angles,
              gaps);
  }
  std::cout << "dropouts of 8 frames, own vocabulary, lag 1: " << error.ours_deg() << " deg, held "
            << error.held_deg() << "\n";
  CHECK(error.ours_deg() <= 0.7 * error.held_deg());
}

TEST_CASE("an unknown hand is not disturbed", "[live]") {
  if (!shared(kGraspFolder) || !shared(kLibras)) {
    SKIP_WITHOUT_SHARED();
  }
  const int step = GENERATE(1, 2);  // 60 and 30 Hz
  const double rate_hz = 60.0 / step;
  for (const smooth::LiveModel* model : {&real_pose_model(), &synthetic_model()}) {
    for (const auto& [noise_deg, lag] : {std::pair{1.0, 1}, {3.0, 1}}) {
      const LiveOptions options = live_options(lag, noise_deg);
      GapError gap_error;
      double square = 0.0;
      double square_without = 0.0;
      for (const char* name : {"10_ex01-rad-003-grasp-su04.txt", "01_ex01-rad-002-grasp-su01.txt",
                               "04_ex01-rad-045-grasp-su03.txt"}) {
        const Motion truth = unknown_hand(*shared(kGraspFolder) / name, step);
        const Motion measured = noisy(truth, noise_deg, 11);
        const Motion known = followed(measured, rate_hz, options, model).angles;
        const Motion without = followed(measured, rate_hz, options, nullptr).angles;
        square += std::pow(bench::rms_deg(known, truth), 2);
        square_without += std::pow(bench::rms_deg(without, truth), 2);
        const Gaps gaps = with_gaps(measured, 8, 3);
        gap_error.add(truth, followed(gaps.measured, rate_hz, options, model).angles, gaps);
      }
      INFO(rate_hz << " Hz, " << noise_deg << " deg, lag " << lag);
      CHECK(std::sqrt(square) <= 1.01 * std::sqrt(square_without));
      CHECK(gap_error.ours_deg() <= gap_error.held_deg());
    }
  }
}

TEST_CASE("a model is set and removed while the hand moves, without allocation", "[live]") {
  const Skeleton skeleton = hand_skeleton(Side::kRight);
  smooth::LiveSmoother smoother(skeleton, live_options(1, 1.0));
  const SyntheticHand hand = synthetic_hand(6, 3);
  LastFrame last;
  const smooth::LiveModel* const model = &synthetic_model();
  for (Eigen::Index t = 0; t < hand.angles.rows(); ++t) {
    HandAngles angles{};
    for (Eigen::Index c = 0; c < kHandChannels; ++c) {
      angles[static_cast<std::size_t>(c)] = hand.angles(t, c) * kDegree;
    }
    if (t % 40 > 35) angles.fill(std::numeric_limits<double>::quiet_NaN());
    Frame frame;
    set_hand_angles(skeleton, angles, frame);
    frame.header.device_ns = nanoseconds(static_cast<double>(t) / 30.0);
    const auto before = allocations();
    if (t == 100) CHECK(smoother.set_model(model) == nullptr);
    if (t == 250) CHECK(smoother.set_model(nullptr) == model);
    smoother.process({.frame = frame}, last);
    if (allocations() != before) FAIL("takes memory");
    if (t == 200) CHECK(last.out.label[0] != '\0');
    if (t == 260) CHECK(last.out.label[0] == '\0');
  }
}

// The model has no information about frames that came before it: they keep the pose of the plain
// window, without a label.
TEST_CASE("a model that is set while frames wait neither labels nor changes them", "[live]") {
  const Skeleton skeleton = hand_skeleton(Side::kRight);
  const smooth::LiveModel* const model = &synthetic_model();
  const SyntheticHand hand = synthetic_hand(6, 3);
  for (const int lag : {2, 3, 8}) {
    INFO("lag " << lag);
    smooth::LiveSmoother plain(skeleton, live_options(lag, 1.0)),
        swapped(skeleton, live_options(lag, 1.0));
    LastFrame without, with_model;
    const auto step = [&](int t) {
      HandAngles angles{};
      for (Eigen::Index c = 0; c < kHandChannels; ++c) {
        angles[static_cast<std::size_t>(c)] = hand.angles(t, c) * kDegree;
      }
      Frame frame;
      set_hand_angles(skeleton, angles, frame);
      frame.header.device_ns = nanoseconds(t / 30.0);
      plain.process({.frame = frame}, without);
      swapped.process({.frame = frame}, with_model);
    };
    for (int t = 0; t < 60; ++t) step(t);
    REQUIRE(swapped.set_model(model) == nullptr);
    step(60);
    CHECK(with_model.out.label[0] == '\0');
    CHECK(with_model.out.label_probability == 0.0F);
    swapped.set_model(model);  // once more, without any frame in between
    plain.flush(without);
    swapped.flush(with_model);
    CHECK(with_model.count == without.count);
    CHECK(with_model.out.label[0] == '\0');
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      REQUIRE(std::isfinite(with_model.out.angle_rad[c]));
      CHECK(with_model.out.angle_rad[c] == Approx(without.out.angle_rad[c]).margin(1e-3));
    }
  }
}

TEST_CASE("a model without a hand, or without labels, is refused", "[live]") {
  const auto model = gesture::train_gesture({recording_of(synthetic_hand(100, 1))}, {}).value();
  const auto body = smooth::bind_live_model(model, body_with_channels(45), "H.gesture");
  REQUIRE_FALSE(body);
  CHECK(body.error().text().find("H.gesture") != std::string::npos);
  gesture::GestureModel empty = model;
  for (gesture::Label& label : empty.labels) label.trained = false;
  CHECK_FALSE(smooth::bind_live_model(empty, hand_skeleton(Side::kLeft), "H.gesture"));
}
