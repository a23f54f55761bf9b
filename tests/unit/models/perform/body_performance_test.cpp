// Gestures of a body: a movement that was never recorded is composed group by group, and performed
// on a figure whose feet stand.
#include "models/perform/body_performance.hpp"

#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <utility>

#include <catch2/catch.hpp>

#include "models/gesture/model_file.hpp"
#include "models/motion/kinematics.hpp"
#include "models/motion/naturalness.hpp"
#include "proto/clip/clip.hpp"
#include "tests/support/arm_raiser.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/synthetic_arms.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::perform {
namespace {

using test::ArmTake;

double jerk_of(const motion::Rows& rows, const gesture::ChannelGroup& group) {
  return motion::jerk_rms(rows.middleCols(group.first, group.channels)) / kDegree;
}

// A motion without what changes from frame to frame: the filter 1/4, 1/2, 1/4 halves 7.5 Hz at 30.
motion::Rows without_ripple(const motion::Rows& rows) {
  motion::Rows smooth = rows;
  for (Eigen::Index t = 1; t + 1 < rows.rows(); ++t) {
    smooth.row(t) = 0.25 * rows.row(t - 1) + 0.5 * rows.row(t) + 0.25 * rows.row(t + 1);
  }
  return smooth;
}

// How the right arm waves in the middle half of a recording's first label, or of the labels of that
// name that follow each other.
struct Wave {
  double deviation_deg = 0.0, rate_hz = 0.0;
};
Wave wave_of(const gesture::Vocabulary& vocabulary, gesture::Recording recording,
             const std::string& label) {
  int from = -1, to = 0;
  for (const gesture::Segment& segment : recording.segments) {
    if (segment.label != label) continue;
    if (from < 0) from = segment.begin;
    to = segment.end;
  }
  const auto group =
      std::ranges::find(vocabulary.groups, "right-arm", &gesture::ChannelGroup::name);
  recording.angles_rad =
      gesture::FeatureMatrix(recording.angles_rad.middleCols(group->first, group->channels));
  const int quarter = (to - from) / 4;
  const auto found = gesture::oscillation_in(recording, from + quarter, to - quarter);
  Wave wave{.deviation_deg = found.deviation_rad / kDegree};
  if (found.cycles.size() > 1) {
    wave.rate_hz = recording.rate_hz * static_cast<double>(found.cycles.size() - 1) /
                   (found.cycles.back() - found.cycles.front());
  }
  return wave;
}

// The label, so many times between rests.
std::string repeated(const std::string& label, int times) {
  std::string text = "rest ";
  for (int i = 0; i < times; ++i) text += label + " ";
  return text + "rest";
}

// Takes of one movement that real people made: 001 to 004 are learnt from, 005 and 006 kept back.
// Nobody recorded both arms at once there, so each arm is compared with that of its own takes.
class RealArms {
 public:
  RealArms(std::filesystem::path folder, std::vector<std::string> movements,
           const std::vector<test::ArmLabel>& labels, gesture::Hold hold = gesture::Hold::kWhole)
      : folder_(std::move(folder)) {
    std::vector<ArmTake> takes;
    for (int number = 1; number <= 4; ++number) {
      for (const std::string& movement : movements) takes.push_back(take(movement, number));
    }
    model =
        test::train_arms(takes, test::arm_vocabulary(*takes.front().clip.skeleton, labels), hold);
  }

  // The squared angles [deg^2] between a held pose's arm and that of the movement's takes, and how
  // its jerk compares with theirs.
  double squared_off_deg(const Performance& performance, const std::string& arm,
                         const std::string& movement, std::size_t label = 0) const {
    const Eigen::VectorXd held = test::held_pose(performance, label);
    const auto group = std::ranges::find(model.groups, arm, &gesture::ChannelGroup::name);
    double squares = 0.0, least = 1e9, most = 0.0, smooth = 0.0;
    for (const int number : {5, 6}) {
      const gesture::Recording recording = seen(movement, number);
      for (const gesture::LabelPose& pose : gesture::label_poses({recording})) {
        if (pose.name != movement) continue;
        const Eigen::Map<const Eigen::VectorXd> real(pose.angles_rad.data(), held.size());
        squares += test::squared_apart_deg(model, arm, held, real) / 2.0;
      }
      least = std::min(least, jerk_of(recording.angles_rad, *group));
      most = std::max(most, jerk_of(recording.angles_rad, *group));
      smooth += jerk_of(without_ripple(recording.angles_rad), *group) / 2.0;
    }
    const double jerk = jerk_of(recording_of(model, performance).angles_rad, *group);
    std::cout << arm << " as in " << movement << ": " << std::sqrt(squares / 4.0)
              << " deg off, jerk " << jerk << " deg/frame^3, real " << least << " to " << most
              << ", without ripple " << smooth << "\n";
    CHECK(jerk <= most);
    return squares;
  }

  gesture::GestureModel model;

  // A take as the model sees it, labelled as a whole.
  [[nodiscard]] gesture::Recording seen(const std::string& movement, int number) const {
    auto recording = gesture::body_recording(take(movement, number).clip, 30.0, model);
    REQUIRE(recording.has_value());
    recording->segments = gesture::propose_movement(*recording, movement, "rest").value();
    return std::move(*recording);
  }

 private:
  [[nodiscard]] ArmTake take(const std::string& movement, int number) const {
    const bool left = movement.ends_with("left");
    const std::string what = movement.starts_with("raise") ? "raise-up" : "wave";
    auto clip = clip::read_clip(folder_ / ("dataset-2_" + what + (left ? "-left" : "-right") +
                                           "-hand_normal_00" + std::to_string(number) + ".bvh"));
    REQUIRE(clip.has_value());
    return {std::move(*clip), movement};
  }

  std::filesystem::path folder_;
};

}  // namespace

TEST_CASE("Both arms are raised, which was never recorded", "[body]") {
  const gesture::GestureModel model = test::synthetic_arms();
  const auto performance = test::perform_text(model, "raise-both rest raise-left");
  const auto body = test::raise_take({.take = 99});
  const auto performed = perform_on(model, performance, body);
  REQUIRE(performed.has_value());
  REQUIRE(performed->clip.frames() == std::ssize(performance.angles));
  const auto held = [&](std::size_t label) {
    const test::HeldFrames frames = test::held_frames(performance, label);
    return (frames.from + frames.to) / 2;
  };
  const auto arm_deg = [&](int frame, Bone bone) {
    return test::raised_deg(*performed->clip.skeleton, performed->clip.frame(frame), bone);
  };
  CHECK(arm_deg(held(0), Bone::kLeftUpperArm) == Approx(62.0).margin(4.0));
  CHECK(arm_deg(held(0), Bone::kRightUpperArm) == Approx(-62.0).margin(4.0));
  CHECK(arm_deg(held(1), Bone::kLeftUpperArm) == Approx(-70.0).margin(8.0));
  CHECK(arm_deg(held(2), Bone::kLeftUpperArm) == Approx(62.0).margin(4.0));
  CHECK(arm_deg(held(2), Bone::kRightUpperArm) == Approx(70.0).margin(4.0));
  CHECK(performed->feet_off_m < 0.01);
}

TEST_CASE("A body's performance stands where the body stands", "[body]") {
  const gesture::GestureModel model = test::synthetic_arms();
  clip::Clip body = test::raise_take({.take = 99});
  for (Eigen::Index c = 0; c < body.channels.cols(); ++c) {
    const Channel& channel = body.skeleton->channels[static_cast<std::size_t>(c)];
    if (channel.translation && channel.axis == Axis::kX) body.channels.col(c).setConstant(3.0);
    const bool hips = channel.joint == body.skeleton->root_joint && !channel.translation;
    if (hips && channel.axis == Axis::kY) body.channels.col(c).array() += 1.0;
  }
  const auto performed = perform_on(model, test::perform_text(model, "raise-both"), body);
  REQUIRE(performed.has_value());
  const auto place = [&](const Frame& frame, Bone bone) {
    const auto joint = static_cast<std::size_t>(body.skeleton->joint_of(bone));
    return motion::world_pose(*body.skeleton, frame).position_m[joint];
  };
  for (int t = 0; t < performed->clip.frames(); t += 7) {
    const Frame frame = performed->clip.frame(t);
    CHECK((place(frame, Bone::kLeftFoot) - place(body.frame(0), Bone::kLeftFoot)).norm() < 0.02);
    CHECK((place(frame, Bone::kRightFoot) - place(body.frame(0), Bone::kRightFoot)).norm() < 0.02);
  }
  CHECK_FALSE(perform_on(test::toy_gesture_model(), {}, body).has_value());
}

TEST_CASE("A model of bodies reads back as it was written", "[body]") {
  const gesture::GestureModel model = test::synthetic_arms();
  const std::string bytes = gesture::serialize_model(model);
  const auto parsed = gesture::parse_model(std::as_bytes(std::span(bytes)), "body.gesture");
  REQUIRE(parsed.has_value());
  CHECK(gesture::serialize_model(*parsed) == bytes);
  REQUIRE(parsed->body.has_value());
  CHECK(parsed->groups.size() == 5);
  const auto performance = test::perform_text(model, "raise-both rest");
  CHECK(test::perform_text(*parsed, "raise-both rest").angles == performance.angles);
}

TEST_CASE("Both arms of a real person are raised, which nobody recorded", "[body][real]") {
  const auto folder = test::shared("data/styles");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  const RealArms arms(*folder, {"raise-left", "raise-right"}, test::kRaises);
  const auto performance = test::perform_text(arms.model, "raise-both rest");
  const double squares = arms.squared_off_deg(performance, "left-arm", "raise-left") +
                         arms.squared_off_deg(performance, "right-arm", "raise-right");
  CHECK(std::sqrt(squares / 8.0) < 11.0);  // of eight joints
}

TEST_CASE("A wave that is cut at its cycles waves, for as long as it is asked to", "[body]") {
  std::vector<ArmTake> takes;
  for (std::uint32_t take = 1; take <= 4; ++take) {
    takes.push_back(
        {test::raise_take({.right = true, .wave = true, .take = 40 + take}), "wave-right"});
    takes.push_back({test::raise_take({.left = true, .take = take}), "raise-left"});
  }
  const auto vocabulary = test::arm_vocabulary(
      *takes.front().clip.skeleton,
      {{"rest", 0, 0}, {"raise-left", 1, 0}, {"wave-right", 0, 1}, {"both", 1, 1}});
  const auto waved = [&](gesture::Hold hold, const std::string& label, int times) {
    const gesture::GestureModel model = test::train_arms(takes, vocabulary, hold);
    const auto performance = test::perform_text(model, repeated(label, times));
    return wave_of(model, recording_of(model, performance), label);
  };
  const double real_deg = test::kWave_deg / std::numbers::sqrt2;
  for (const int times : {5, 9}) {
    const Wave wave = waved(gesture::Hold::kCycles, "wave-right", times);
    CHECK(wave.deviation_deg > 0.7 * real_deg);
    CHECK(wave.rate_hz == Approx(test::kWave_hz).epsilon(0.15));
  }
  CHECK(waved(gesture::Hold::kWhole, "wave-right", 1).deviation_deg < 0.3 * real_deg);
}

TEST_CASE("A real wave waves as those do that were kept back", "[body][real]") {
  const auto folder = test::shared("data/styles");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  const std::vector<test::ArmLabel> labels{
      {"rest", 0, 0}, {"raise-left", 1, 0}, {"wave-right", 0, 1}, {"wave-raise", 1, 1}};
  for (const auto hold : {gesture::Hold::kWhole, gesture::Hold::kCycles}) {
    const RealArms arms(*folder, {"raise-left", "wave-right"}, labels, hold);
    const bool cut = hold == gesture::Hold::kCycles;
    for (const std::string label : {"wave-right", "wave-raise"}) {
      const auto performance = test::perform_text(arms.model, repeated(label, cut ? 7 : 1));
      const Wave wave = wave_of(arms.model, recording_of(arms.model, performance), label);
      std::cout << label << (cut ? ", cut at cycles: " : ", whole: ") << wave.deviation_deg
                << " deg at " << wave.rate_hz << " Hz\n";
      if (!cut) {
        CHECK(wave.deviation_deg < 5.0);
        continue;
      }
      for (const int number : {5, 6}) {
        const Wave real = wave_of(arms.model, arms.seen("wave-right", number), "wave-right");
        std::cout << "take " << number << ": " << real.deviation_deg << " deg at " << real.rate_hz
                  << " Hz\n";
        CHECK(wave.deviation_deg == Approx(real.deviation_deg).epsilon(0.15));
        CHECK(wave.rate_hz == Approx(real.rate_hz).epsilon(0.15));
      }
      // The other arm stays up while the wave goes on.
      if (label != "wave-raise") continue;
      for (const std::size_t repetition : {2U, 4U, 6U}) {
        const double squares =
            arms.squared_off_deg(performance, "left-arm", "raise-left", repetition);
        CHECK(std::sqrt(squares / 4.0) < 11.0);
      }
    }
  }
}

TEST_CASE("One arm of a real person is raised while the other waves", "[body][real]") {
  const auto folder = test::shared("data/styles");
  if (!folder) {
    SKIP_WITHOUT_SHARED();
  }
  const RealArms arms(
      *folder, {"raise-left", "wave-right"},
      {{"rest", 0, 0}, {"raise-left", 1, 0}, {"wave-right", 0, 1}, {"wave-raise", 1, 1}});
  const auto performance = test::perform_text(arms.model, "wave-raise rest");
  const double squares = arms.squared_off_deg(performance, "left-arm", "raise-left") +
                         arms.squared_off_deg(performance, "right-arm", "wave-right");
  CHECK(std::sqrt(squares / 8.0) < 11.0);
}

}  // namespace posed::perform
