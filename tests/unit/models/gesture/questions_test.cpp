// Finger classes: the set of Takamido et al., written lists, proposals, and a pose shown once.
#include <catch2/catch.hpp>

#include "models/gesture/questions.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

using namespace posed;
using namespace posed::gesture;

namespace {

// The pose of the toy hand for a label's classes.
LabelPose toy_pose(const std::string& name, const std::vector<int>& classes) {
  LabelPose pose{name, std::vector<double>(kHandChannels)};
  for (int f = 0; f < kFingers; ++f) {
    for (int joint = 0; joint < kFingerJoints; ++joint) {
      pose.angles_rad[f * kFingerChannels + 3 * joint] = test::toy_flexion(f, joint, classes[f]);
    }
  }
  return pose;
}

std::vector<LabelPose> toy_poses() {
  return {toy_pose("g", {0, 0, 0, 0, 0}), toy_pose("c", {1, 1, 1, 1, 1}),
          toy_pose("p", {2, 2, 2, 2, 2})};
}

std::string refusal(const ClassLists& lists) {
  const auto labels = labels_of(lists);
  return labels ? "" : labels.error().message;
}

}  // namespace

TEST_CASE("The built-in set is that of Takamido et al.", "[questions]") {
  const auto lists = lists_of(built_in_labels());
  CHECK(lists[2][0] ==
        std::vector<std::string>{"g", "1"});  // middle, stated by Takamido et al., section 4.1
  CHECK(lists[2][1] == std::vector<std::string>{"c"});
  CHECK(lists[2][2] == std::vector<std::string>{"p", "3", "4"});
  const auto labels = labels_of(lists);
  REQUIRE(labels.has_value());
  REQUIRE(labels->size() == 6);
  for (const Label& label : built_in_labels()) {
    const auto same = std::ranges::find(*labels, label.name, &Label::name);
    REQUIRE(same != labels->end());
    CHECK(same->group_class == label.group_class);
  }
}

TEST_CASE("A label in no class or in two is refused", "[questions]") {
  ClassLists lists = lists_of(built_in_labels());
  std::erase(lists[3][0], "1");
  CHECK(refusal(lists) == "label '1' is in no class of the ring; add it to A, B or C of [ring]");
  lists[3] = {{"g", "1"}, {"c", "1"}, {"p", "3", "4"}};
  CHECK(refusal(lists).find("'1' is in the classes A and B of the ring") != std::string::npos);
  lists[3][1] = {"c", "two words"};
  CHECK(refusal(lists).find("is no label") != std::string::npos);
}

TEST_CASE("Proposals sort fingers from closed to open", "[questions]") {
  auto poses = toy_poses();
  poses.push_back(toy_pose("3", {0, 2, 2, 2, 0}));
  const auto labels = propose_labels(poses);
  REQUIRE(labels.size() == 4);
  for (int f = 1; f < kFingers; ++f) CHECK(labels[0].group_class[f] == 0);  // the fist is closed
  CHECK(labels[2].group_class == std::vector<int>{2, 2, 2, 2, 2});
  CHECK(labels[3].group_class == std::vector<int>{0, 2, 2, 2, 0});
  CHECK(labels_of(lists_of(labels)).has_value());
  // One label, and labels that look alike, are sorted too.
  CHECK(propose_labels({poses[0]}).front().group_class == std::vector<int>(kFingers));
  CHECK(propose_labels({poses[0], poses[0], poses[0]}).size() == 3);
}

TEST_CASE("A pose shown once takes each finger's class from the nearest pose", "[questions]") {
  auto shown = toy_pose("new", {0, 2, 1, 0, 2});
  for (double& angle : shown.angles_rad) angle += 0.02;
  CHECK(composed_off_rad(toy_poses()[0], toy_poses()) == 0.0);
  LabelPose off = toy_poses()[0];
  for (double& angle : off.angles_rad) angle += 0.01;
  CHECK(composed_off_rad(off, toy_poses()) == Approx(0.01).margin(1e-9));
  const Label label = label_like(shown, toy_poses(), built_in_labels());
  CHECK(label.name == "new");
  CHECK(label.group_class == std::vector<int>{0, 2, 1, 0, 2});
}
