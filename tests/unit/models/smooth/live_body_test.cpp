// The live smoother with a gesture model of a body: it names movements, steadies them and bridges
// gaps, on synthetic bodies and on recordings.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "tests/bench/baselines.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/gaps.hpp"
#include "tests/support/live_body.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/synthetic_arms.hpp"

namespace posed::smooth {
namespace {

using test::ArmTake;
using test::followed_body;
using test::FollowedBody;
using test::Motion;

std::unique_ptr<const LiveModel> bound(const gesture::GestureModel& model,
                                       const Skeleton& skeleton) {
  auto live = bind_live_model(model, skeleton, "test");
  REQUIRE(live.has_value());
  return std::move(*live);
}

// A take as the model sees it, labelled as one movement.
gesture::Recording seen(const ArmTake& take, double rate_hz, const gesture::GestureModel& model) {
  auto recording = gesture::body_recording(take.clip, rate_hz, model);
  REQUIRE(recording.has_value());
  recording->segments = gesture::propose_movement(*recording, take.movement, "rest").value();
  return std::move(*recording);
}

Motion degrees(const gesture::Recording& recording) { return recording.angles_rad / kDegree; }

struct SyntheticArms {
  gesture::GestureModel model = test::synthetic_arms();
  ArmTake kept{test::raise_take({.left = true, .take = 77}), "raise-left"};
  std::unique_ptr<const LiveModel> live = bound(model, *kept.clip.skeleton);

  [[nodiscard]] FollowedBody follow(const Motion& measured, double rate_hz, int lag,
                                    const LiveModel* with) const {
    return followed_body(model, kept.clip, measured, rate_hz, test::live_options(lag, 1.0), with);
  }
};

const SyntheticArms& arms() {
  static const SyntheticArms kArms;
  return kArms;
}

// How many of the frames after half a second are none of the labels, and how surely.
struct NoneShare {
  double share, probability;
};
NoneShare none_of(const clip::Clip& clip, const LiveModel& live) {
  LiveSmoother smoother(*clip.skeleton, test::live_options(1, 0.5), &live);
  test::Frames out;
  for (int t = 0; t < clip.frames(); ++t) {
    Frame frame = clip.frame(t);
    frame.header.device_ns = nanoseconds(t / clip.frame_rate_hz);
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  double none = 0.0, sum = 0.0, frames = 0.0;
  for (auto t = static_cast<std::size_t>(0.5 * clip.frame_rate_hz); t < out.all.size(); ++t) {
    frames += 1.0;
    if (out.all[t].label.data() != kNoneName) continue;
    none += 1.0;
    sum += static_cast<double>(out.all[t].label_probability);
  }
  return {.share = none / frames, .probability = sum / std::max(none, 1.0)};
}

// The takes of four movements that real people made.
class RealTakes {
 public:
  explicit RealTakes(std::filesystem::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] ArmTake take(const std::string& movement, int number) const {
    const bool left = movement.ends_with("left");
    const std::string what = movement.starts_with("raise") ? "raise-up" : "wave";
    auto clip = clip::read_clip(folder_ / ("dataset-2_" + what + (left ? "-left" : "-right") +
                                           "-hand_normal_00" + std::to_string(number) + ".bvh"));
    REQUIRE(clip.has_value());
    return {std::move(*clip), movement};
  }

  // Learnt from all takes but those of one number.
  [[nodiscard]] gesture::GestureModel without(int kept,
                                              gesture::Hold hold = gesture::Hold::kWhole) const {
    std::vector<ArmTake> takes;
    for (int number = 1; number <= 6; ++number) {
      for (const std::string& movement : kMovements) {
        if (number != kept) takes.push_back(take(movement, number));
      }
    }
    const std::vector<test::ArmLabel> labels{{"rest", 0, 0},
                                             {"raise-left", 1, 0},
                                             {"raise-right", 0, 1},
                                             {"wave-left", 2, 0},
                                             {"wave-right", 0, 2}};
    return test::train_arms(takes, test::arm_vocabulary(*takes.front().clip.skeleton, labels),
                            hold);
  }

  static inline const std::vector<std::string> kMovements{"raise-left", "raise-right", "wave-left",
                                                          "wave-right"};

 private:
  std::filesystem::path folder_;
};

}  // namespace

TEST_CASE("a live body's movements are recognised", "[live][body]") {
  for (const double rate_hz : {30.0, 120.0}) {
    const gesture::Recording truth = seen(arms().kept, rate_hz, arms().model);
    const FollowedBody reported = arms().follow(degrees(truth), rate_hz, 1, arms().live.get());
    test::FrameScore score;
    score.add(reported.label, truth, 0.3);
    INFO(rate_hz << " Hz");
    CHECK(score.share() >= 0.9);
    REQUIRE(reported.frames.size() == static_cast<std::size_t>(truth.angles_rad.rows()));
    CHECK(arms().follow(degrees(truth), rate_hz, 1, nullptr).label[40].empty());
  }
}

TEST_CASE("a body's movements are steadied, and dropouts bridged", "[live][body]") {
  const gesture::Recording truth = seen(arms().kept, 30.0, arms().model);
  for (const double noise_deg : {1.0, 3.0}) {
    const Motion measured = test::noisy(degrees(truth), noise_deg, 5);
    const auto rms_deg = [&](const LiveModel* model) {
      const auto options = test::live_options(1, noise_deg);
      const FollowedBody reported =
          followed_body(arms().model, arms().kept.clip, measured, 30.0, options, model);
      return bench::rms_deg(reported.channels, degrees(truth));
    };
    INFO(noise_deg << " deg");
    CHECK(rms_deg(arms().live.get()) < 0.7 * bench::rms_deg(measured, degrees(truth)));
    CHECK(rms_deg(arms().live.get()) < 1.02 * rms_deg(nullptr));
  }
  const test::Gaps gaps = test::with_gaps(test::noisy(degrees(truth), 1.0, 5), 8, 3);
  const FollowedBody reported = arms().follow(gaps.measured, 30.0, 1, arms().live.get());
  test::GapError error;
  error.add(degrees(truth), reported.channels, gaps);
  CHECK(error.ours_deg() < error.held_deg());
  for (std::size_t t = 0; t < reported.frames.size(); ++t) {
    CHECK((reported.frames[t].quality == Quality::kPredicted) == gaps.missing[t]);
  }
}

TEST_CASE("a model of a body comes and goes without memory and without a jump", "[live][body]") {
  const gesture::Recording truth = seen(arms().kept, 30.0, arms().model);
  const Skeleton& skeleton = *arms().kept.clip.skeleton;
  LiveSmoother smoother(skeleton, test::live_options(2, 0.5));
  test::Frames out;
  out.all.reserve(200);
  for (int t = 0; t < 80; ++t) {
    Frame frame = arms().kept.clip.frame(t);
    frame.header.sequence = static_cast<std::uint64_t>(t + 1);
    frame.header.device_ns = nanoseconds(t / 30.0);
    const auto before = test::allocations();
    if (t == 30) static_cast<void>(smoother.set_model(arms().live.get()));
    if (t == 60) static_cast<void>(smoother.set_model(nullptr));
    smoother.process({.frame = frame}, out);
    if (t > 3 && test::allocations() != before) FAIL("takes memory");
  }
  REQUIRE(out.all.size() == 78);
  for (std::size_t t = 1; t < out.all.size(); ++t) {
    CHECK(out.all[t].header.sequence == t + 1);
    const double up = test::raised_deg(skeleton, out.all[t], Bone::kLeftUpperArm);
    const double real = test::raised_deg(skeleton, arms().kept.clip.frame(static_cast<int>(t)),
                                         Bone::kLeftUpperArm);
    CHECK(up == Approx(real).margin(2.0));
  }
  CHECK(out.all[20].label[0] == '\0');
  CHECK(out.all[50].label[0] != '\0');
  CHECK(out.all[70].label[0] == '\0');
}

TEST_CASE("a body without joint angles of its own is followed, too", "[live][body]") {
  clip::Clip bare = arms().kept.clip;
  Skeleton joints = *bare.skeleton;
  joints.channels.clear();
  REQUIRE(joints.finish());
  const auto live = bound(arms().model, joints);
  LiveSmoother smoother(joints, test::live_options(1, 1.0), live.get());
  test::Frames out;
  for (int t = 0; t < bare.frames(); ++t) {
    Frame frame = bare.frame(t);
    frame.skeleton = joints.id;
    frame.angle_count = 0;
    frame.header.device_ns = nanoseconds(t / 30.0);
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  REQUIRE(static_cast<int>(out.all.size()) == bare.frames());
  CHECK(out.all[45].lag_frames == 1);
  CHECK(std::string(out.all[45].label.data()) == "raise-left");
  CHECK(out.variance_rad2.empty());
}

TEST_CASE("a body that does none of the movements is told so", "[live][body]") {
  const auto walk = motion::make_walker({.seconds = 4.0, .rate_hz = 30.0});
  REQUIRE(walk.has_value());
  const auto live = bound(arms().model, *walk->skeleton);
  const auto none = none_of(*walk, *live);
  CHECK(none.share > 0.95);
  CHECK(none.probability > 0.9);
  CHECK(none_of(arms().kept.clip, *arms().live).share == 0.0);
  // A model that has learnt its own "none" needs no other.
  gesture::GestureModel own = arms().model;
  own.labels[0].name = std::string(kNoneName);
  CHECK_FALSE(bound(own, *walk->skeleton)->none.has_value());
}

TEST_CASE("real people who walk, run and turn do none of the movements", "[live][body][real]") {
  const auto folder = test::shared("data/styles");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  const gesture::GestureModel model = RealTakes(*folder).without(6);
  int clips = 0;
  double least = 1.0;
  for (const auto& entry : std::filesystem::directory_iterator(*folder)) {
    const std::string name = entry.path().filename().string();
    // The model's skeleton is Bandai's, so only its data sets can be asked.
    if (!name.starts_with("dataset-") || !name.ends_with(".bvh") ||
        (name.find("_walk") == std::string::npos && name.find("_run") == std::string::npos)) {
      continue;
    }
    const auto clip = clip::read_clip(entry.path());
    REQUIRE(clip.has_value());
    least = std::min(least, none_of(*clip, *bound(model, *clip->skeleton)).share);
    ++clips;
  }
  std::cout << clips << " clips of walking and running: at least " << least
            << " of the frames after 0.5 s are none\n";
  CHECK(least > 0.95);
}

TEST_CASE("five movements of real people are recognised", "[live][body][real]") {
  const auto folder = test::shared("data/styles");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  const RealTakes takes(*folder);
  const auto hold = GENERATE(gesture::Hold::kWhole, gesture::Hold::kCycles);
  test::FrameScore all;
  for (int kept = 1; kept <= 6; ++kept) {
    const gesture::GestureModel model = takes.without(kept, hold);
    test::FrameScore score;
    for (const std::string& movement : RealTakes::kMovements) {
      const ArmTake take = takes.take(movement, kept);
      const auto live = bound(model, *take.clip.skeleton);
      const gesture::Recording truth = seen(take, 30.0, model);
      const FollowedBody reported = followed_body(model, take.clip, degrees(truth), 30.0,
                                                  test::live_options(1, 0.5), live.get());
      score.add(reported.label, truth, 0.3);
      all.add(reported.label, truth, 0.3);
    }
    std::cout << "take " << kept << " kept back: " << score.share() << " of " << score.frames()
              << " frames right after 0.3 s\n";
  }
  std::cout << (hold == gesture::Hold::kCycles ? "learnt from cycles, " : "")
            << "all: " << all.share() << "\n";
  CHECK(all.share() >= 0.9);
}

TEST_CASE("a real body is steadied more than by filters tuned on it", "[live][body][real]") {
  const auto folder = test::shared("data/styles");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  const RealTakes takes(*folder);
  const gesture::GestureModel model = takes.without(6);
  for (const double rate_hz : {30.0, 120.0}) {
    for (const double noise_deg : {1.0, 3.0}) {
      std::vector<bench::Trial> trials;
      double squares = 0.0, without = 0.0;
      for (const std::string& movement : RealTakes::kMovements) {
        const ArmTake take = takes.take(movement, 6);
        const auto live = bound(model, *take.clip.skeleton);
        const Motion truth = degrees(seen(take, rate_hz, model));
        const Motion measured = test::noisy(truth, noise_deg, 11);
        trials.push_back({.truth = truth, .measured = measured, .rate_hz = rate_hz});
        const auto error = [&](const LiveModel* with) {
          const auto options = test::live_options(1, noise_deg);
          const FollowedBody reported =
              followed_body(model, take.clip, measured, rate_hz, options, with);
          return std::pow(bench::rms_deg(reported.channels, truth), 2) / 4.0;
        };
        squares += error(live.get());
        without += error(nullptr);
      }
      std::cout << rate_hz << " Hz, " << noise_deg << " deg, lag 1: " << std::sqrt(squares)
                << " deg, without the model " << std::sqrt(without);
      for (const bench::Tuned& tuned : bench::tuned_baselines(trials, 1, noise_deg)) {
        std::cout << ", " << tuned.name << " " << tuned.rms_deg;
        CHECK(std::sqrt(squares) < tuned.rms_deg);
      }
      std::cout << "\n";
    }
  }
}

}  // namespace posed::smooth
