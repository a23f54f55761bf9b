// Gesture models of arms that are raised, trained from takes of one movement each, and how far the
// arms of a performance are held from those of a take. Shared by tests on synthetic bodies and on
// recordings.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "models/gesture/body_recording.hpp"
#include "models/gesture/movement_label.hpp"
#include "models/gesture/questions.hpp"
#include "models/gesture/train.hpp"
#include "models/perform/perform.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::test {

struct ArmTake {
  clip::Clip clip;
  std::string movement;
};

// A label, and the classes of the arms in it; the rest of the body has one class.
struct ArmLabel {
  const char* name;
  int left, right;
};
inline const std::vector<ArmLabel> kRaises{
    {"rest", 0, 0}, {"raise-left", 1, 0}, {"raise-right", 0, 1}, {"raise-both", 1, 1}};

// The groups of this skeleton with the classes of these labels.
inline gesture::Vocabulary arm_vocabulary(const Skeleton& skeleton,
                                          const std::vector<ArmLabel>& labels = kRaises) {
  gesture::Vocabulary vocabulary = gesture::body_vocabulary(gesture::body_groups(skeleton)).value();
  for (const ArmLabel& label : labels) {
    gesture::Label& added = vocabulary.labels.emplace_back(gesture::Label{.name = label.name});
    for (gesture::ChannelGroup& group : vocabulary.groups) {
      const int arm = group.name == "left-arm"    ? label.left
                      : group.name == "right-arm" ? label.right
                                                  : 0;
      added.group_class.push_back(arm);
      group.classes = std::max(group.classes, arm + 1);
    }
  }
  return vocabulary;
}

// Labels every take as its movement, then rest.
inline std::vector<gesture::Recording> labelled(const std::vector<ArmTake>& takes,
                                                gesture::Vocabulary& vocabulary,
                                                gesture::Hold hold = gesture::Hold::kWhole) {
  std::vector<clip::Clip> clips;
  for (const ArmTake& take : takes) clips.push_back(take.clip);
  auto recordings = gesture::body_recordings(clips, 30.0, vocabulary);
  REQUIRE(recordings.has_value());
  for (std::size_t i = 0; i < takes.size(); ++i) {
    auto segments = gesture::propose_movement((*recordings)[i], takes[i].movement, "rest", hold);
    REQUIRE(segments.has_value());
    (*recordings)[i].segments = *segments;
  }
  return *recordings;
}

inline gesture::GestureModel train_arms(const std::vector<ArmTake>& takes,
                                        gesture::Vocabulary vocabulary,
                                        gesture::Hold hold = gesture::Hold::kWhole) {
  const auto recordings = labelled(takes, vocabulary, hold);
  gesture::TrainOptions options;
  options.vocabulary = std::move(vocabulary);
  auto model = gesture::train_gesture(recordings, options);
  REQUIRE(model.has_value());
  return std::move(*model);
}

inline perform::Performance perform_text(const gesture::GestureModel& model,
                                         const std::string& text) {
  const trajectory::StateInformation information(
      std::make_shared<const gesture::GestureModel>(model), model.rate_hz);
  return perform::perform(information, perform::labels_of(model, text).value(), {}).value();
}

// Frames [from, to) in which the performance's `index`-th label is held, as label_poses() has them
// of a recording.
struct HeldFrames {
  int from, to;
};
inline HeldFrames held_frames(const perform::Performance& performance, std::size_t index) {
  const auto& first = performance.states[index * gesture::kStates];
  const auto& last = performance.states[(index + 1) * gesture::kStates - 1];
  const int end = last.start + last.frames;
  const int frames = end - first.start;
  return {first.start + frames / 2, end - frames / 10};
}

// The mean pose in these frames.
inline Eigen::VectorXd held_pose(const perform::Performance& performance, std::size_t index) {
  const HeldFrames held = held_frames(performance, index);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(std::ssize(performance.angles.front()));
  for (int t = held.from; t < held.to; ++t) {
    const perform::Pose& pose = performance.angles[static_cast<std::size_t>(t)];
    sum += Eigen::Map<const Eigen::VectorXd>(pose.data(), std::ssize(pose));
  }
  return sum / (held.to - held.from);
}

// The squared angles [deg^2] between two poses of a group's joints, summed, about the model's
// means.
inline double squared_apart_deg(const gesture::Vocabulary& vocabulary, const std::string& group,
                                const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const auto found = std::ranges::find(vocabulary.groups, group, &gesture::ChannelGroup::name);
  REQUIRE(found != vocabulary.groups.end());
  double squares = 0.0;
  for (int c = found->first; c < found->first + found->channels; c += 3) {
    const Eigen::Vector3d of_a = a.segment<3>(c), of_b = b.segment<3>(c);
    const double deg = angle_between_rad(rotation_exp(of_a), rotation_exp(of_b)) / kDegree;
    squares += deg * deg;
  }
  return squares;
}

}  // namespace posed::test
