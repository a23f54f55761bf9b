// Gestures of a body: a movement that was never recorded is composed group by group, and performed
// on a figure whose feet stand.
#include "models/perform/body_performance.hpp"

#include <cmath>
#include <filesystem>
#include <iostream>
#include <utility>

#include <catch2/catch.hpp>

#include "models/gesture/model_file.hpp"
#include "models/motion/kinematics.hpp"
#include "models/motion/naturalness.hpp"
#include "proto/clip/reader.hpp"
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

motion::Rows rows_of(const Performance& performance) {
  motion::Rows rows(std::ssize(performance.angles), std::ssize(performance.angles.front()));
  for (Eigen::Index t = 0; t < rows.rows(); ++t) {
    const Pose& pose = performance.angles[static_cast<std::size_t>(t)];
    rows.row(t) = Eigen::Map<const Eigen::RowVectorXd>(pose.data(), rows.cols());
  }
  return rows;
}

// Takes of one movement that real people made: 001 to 004 are learnt from, 005 and 006 kept back.
// Nobody recorded both arms at once there, so each arm is compared with that of its own takes.
class RealArms {
 public:
  RealArms(std::filesystem::path folder, std::vector<std::string> movements,
           const std::vector<test::ArmLabel>& labels)
      : folder_(std::move(folder)) {
    std::vector<ArmTake> takes;
    for (int number = 1; number <= 4; ++number) {
      for (const std::string& movement : movements) takes.push_back(take(movement, number));
    }
    model = test::train_arms(takes, test::arm_vocabulary(*takes.front().clip.skeleton, labels));
  }

  // The squared angles [deg^2] between a held pose's arm and that of the movement's takes, and how
  // its jerk compares with theirs.
  double squared_off_deg(const Performance& performance, const std::string& arm,
                         const std::string& movement) const {
    const Eigen::VectorXd held = test::held_pose(performance, 0);
    const auto group = std::ranges::find(model.groups, arm, &gesture::ChannelGroup::name);
    double squares = 0.0, least = 1e9, most = 0.0;
    for (const int number : {5, 6}) {
      const ArmTake kept = take(movement, number);
      auto recording = gesture::body_recording(kept.clip, 30.0, model);
      REQUIRE(recording.has_value());
      recording->segments = gesture::propose_movement(*recording, movement, "rest").value();
      for (const gesture::LabelPose& pose : gesture::label_poses({*recording})) {
        if (pose.name != movement) continue;
        const Eigen::Map<const Eigen::VectorXd> real(pose.angles_rad.data(), held.size());
        squares += test::squared_apart_deg(model, arm, held, real) / 2.0;
      }
      least = std::min(least, jerk_of(recording->angles_rad, *group));
      most = std::max(most, jerk_of(recording->angles_rad, *group));
    }
    const double jerk = jerk_of(rows_of(performance), *group);
    std::cout << arm << " as in " << movement << ": " << std::sqrt(squares / 4.0)
              << " deg off, jerk " << jerk << " deg/frame^3, real " << least << " to " << most
              << "\n";
    CHECK(jerk <= most);
    return squares;
  }

  gesture::GestureModel model;

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
