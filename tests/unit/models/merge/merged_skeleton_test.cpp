// The skeletons of the merge stage, and the poses that they take.
#include <catch2/catch.hpp>

#include "models/merge/merged_skeleton.hpp"
#include "models/motion/kinematics.hpp"
#include "tests/support/last_frame.hpp"
#include "tests/support/merge_rig.hpp"

namespace posed::merge {
namespace {

using test::glove_skeleton;
using test::merge_context;
using test::walker_skeleton;

std::string refused(const StageContext& context) {
  const auto skeleton = merge_type().leaves(context);
  REQUIRE_FALSE(skeleton);
  const auto stage = merge_type().make(context, nullptr);
  REQUIRE_FALSE(stage);
  CHECK(stage.error().message == skeleton.error().message);
  return skeleton.error().message;
}

// A body that has its own fingers, in axes of its own, with a metacarpal that is no bone in the
// left index finger; without any channels.
std::shared_ptr<const Skeleton> fingered_body() {
  const auto left = glove_skeleton(Side::kLeft), right = glove_skeleton(Side::kRight);
  const auto merged =
      merge_skeletons(*walker_skeleton(), {left.get(), right.get()}).value().skeleton;
  auto own = std::make_shared<Skeleton>();
  own->name = "fingered";
  std::vector<int> place;
  const Eigen::Quaterniond axes = axis_rotation(Axis::kX, 0.7) * axis_rotation(Axis::kZ, -0.4);
  for (const Joint& joint : merged->joints) {
    const int parent = joint.parent < 0 ? -1 : place[static_cast<std::size_t>(joint.parent)];
    Joint copy = joint;
    copy.parent = parent;
    copy.T_world_joint = joint.T_world_joint * axes;
    copy.offset_m = 1.1 * (axes.conjugate() * joint.offset_m);
    if (joint.bone && *joint.bone >= Bone::kLeftThumbMetacarpal) copy.name = "own_" + joint.name;
    if (joint.bone == Bone::kLeftIndexProximal) {
      Joint metacarpal = copy;
      metacarpal.name = "metacarpal";
      metacarpal.bone.reset();
      own->joints.push_back(metacarpal);
      copy.parent = static_cast<int>(std::ssize(own->joints)) - 1;
    }
    place.push_back(static_cast<int>(std::ssize(own->joints)));
    own->joints.push_back(std::move(copy));
  }
  own->root_joint = place[static_cast<std::size_t>(merged->root_joint)];
  REQUIRE(own->finish());
  return own;
}

}  // namespace

TEST_CASE("a body without fingers gets those of the glove") {
  const auto body = walker_skeleton();
  const auto glove = glove_skeleton(Side::kLeft);
  const auto merged = merge_type().leaves(merge_context(body, glove)).value();
  CHECK(merged->joints.size() == body->joints.size() + kHandJoints);
  CHECK(merged->joint_of(Bone::kRightIndexProximal) < 0);
  for (const Joint& joint : body->joints) {
    const int at = merged->joint_index(joint.name);
    REQUIRE(at >= 0);
    CHECK(merged->joints[static_cast<std::size_t>(at)].bone == joint.bone);
    CHECK(merged->joints[static_cast<std::size_t>(at)].offset_m == joint.offset_m);
  }
  CHECK(merged->joints[static_cast<std::size_t>(merged->root_joint)].name ==
        body->joints[static_cast<std::size_t>(body->root_joint)].name);
  // In the T-pose the fingers are as far from the wrist as those of the glove, in the same
  // direction of the world.
  const auto tip = [](const Skeleton& skeleton, Bone bone) {
    Frame frame;
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
      const Joint& joint = skeleton.joints[j];
      const Eigen::Quaterniond above =
          joint.parent < 0 ? Eigen::Quaterniond::Identity()
                           : skeleton.joints[static_cast<std::size_t>(joint.parent)].T_world_joint;
      frame.rotation_xyzw[j] = from_eigen(above.conjugate() * joint.T_world_joint);
    }
    frame.joint_count = static_cast<std::uint16_t>(skeleton.joints.size());
    frame.valid.set();
    const auto pose = motion::world_pose(skeleton, frame);
    const auto wrist = static_cast<std::size_t>(skeleton.joint_of(Bone::kLeftHand));
    const auto at = static_cast<std::size_t>(skeleton.joint_of(bone));
    return Eigen::Vector3d(pose.position_m[at] - pose.position_m[wrist]);
  };
  for (int finger = 0; finger < kHandJoints; ++finger) {
    const Bone bone = hand_bone(Side::kLeft, finger);
    INFO(bone_name(bone));
    CHECK((tip(*merged, bone) - tip(*glove, bone)).norm() < 1e-6);
    CHECK(merged->joints[static_cast<std::size_t>(merged->joint_of(bone))].name == bone_name(bone));
  }
}

TEST_CASE("a hand bends as its glove does, on each kind of skeleton") {
  const auto left = glove_skeleton(Side::kLeft), right = glove_skeleton(Side::kRight);
  for (const auto& body : {walker_skeleton(), fingered_body()}) {
    INFO(body->name);
    test::MergeRig rig(merge_context(body, left, right));
    if (body->name == "fingered") {
      CHECK(rig.skeleton->joints.size() == body->joints.size());
      CHECK(rig.skeleton->joint_index("own_leftThumbDistal") >= 0);
      CHECK(rig.skeleton->channels.empty());
    }
    rig.glove(0, test::glove_frame(*left, 0.4, 1));
    rig.body(test::body_frame(*body, 1, 10));
    rig.glove(0, test::glove_frame(*left, 0.5, 20));
    rig.glove(1, test::glove_frame(*right, 0.8, 20));
    REQUIRE(rig.out.size() == 1);
    const Frame& frame = rig.out[0].frame;
    CHECK(frame.skeleton == rig.skeleton->id);
    CHECK(frame.joint_count == rig.skeleton->joints.size());
    CHECK(frame.quality == Quality::kMeasured);
    for (int joint = 0; joint < kHandJoints; ++joint) {
      INFO("joint " << joint);
      CHECK(frame.valid[static_cast<std::size_t>(
          rig.skeleton->joint_of(hand_bone(Side::kLeft, joint)))]);
      CHECK(test::bent_rad(*rig.skeleton, Side::kLeft, joint, frame) ==
            Approx(0.4 + 0.1 * 9 / 19).margin(1e-6));
      CHECK(test::bent_rad(*rig.skeleton, Side::kRight, joint, frame) == Approx(0.8).margin(1e-6));
    }
  }
}

TEST_CASE("the angles of added fingers are those of the glove") {
  const auto left = glove_skeleton(Side::kLeft);
  const auto body = walker_skeleton();
  test::MergeRig rig(merge_context(body, left));
  const Frame glove = test::glove_frame(*left, 0.4, 10);
  rig.glove(0, glove);
  rig.body(test::body_frame(*body, 1, 10));
  rig.glove(0, test::glove_frame(*left, 0.4, 20));
  REQUIRE(rig.out.size() == 1);
  const Frame& frame = rig.out[0].frame;
  std::size_t angle = 0, compared = 0;
  for (const Channel& channel : rig.skeleton->channels) {
    if (channel.translation) continue;
    const Joint& joint = rig.skeleton->joints[channel.joint];
    if (joint.bone >= Bone::kLeftThumbMetacarpal) {
      CHECK(frame.angle_rad[angle] == Approx(glove.angle_rad[compared]).margin(1e-5));
      ++compared;
    }
    ++angle;
  }
  CHECK(compared == kHandChannels);
  CHECK(frame.angle_count == angle);
}

TEST_CASE("what cannot be merged is refused with one sentence") {
  const auto left = glove_skeleton(Side::kLeft), right = glove_skeleton(Side::kRight);
  CHECK(refused(merge_context(walker_skeleton(), right)).contains("no left hand"));
  CHECK(refused(merge_context(right, left)).contains("no leftHand"));
  CHECK(refused(merge_context(walker_skeleton(), left, nullptr, {{"wrist", std::string("glove")}}))
            .contains("does not measure the wrist"));
  auto crowd = std::make_shared<Skeleton>(*walker_skeleton());
  for (int extra = 0; extra < 60; ++extra) {
    Joint joint;
    joint.name = "extra" + std::to_string(extra);
    joint.parent = static_cast<int>(std::ssize(crowd->joints)) - 1;
    crowd->joints.push_back(joint);
  }
  REQUIRE(crowd->finish());
  CHECK(refused(merge_context(crowd, left, right)).contains("carries at most 96"));
  CHECK(refused(merge_context(walker_skeleton(), nullptr)).contains("names no glove"));
  auto odd = merge_context(walker_skeleton(), left, nullptr, {{"wrist", std::string("both")}});
  CHECK(merge_type().check(odd.parameters, false)->parameter == "wrist");
}

TEST_CASE("a glove that measures the wrist turns it, unless the body shall") {
  auto glove = std::make_shared<Skeleton>(*glove_skeleton(Side::kLeft));
  glove->channels.insert(glove->channels.begin(), {.joint = 0, .axis = Axis::kX});
  REQUIRE(glove->finish());
  const auto body = walker_skeleton();
  for (const char* wrist : {"auto", "glove", "body"}) {
    INFO(wrist);
    test::MergeRig rig(merge_context(body, glove, nullptr, {{"wrist", std::string(wrist)}}));
    std::vector<double> values(glove->channels.size(), 0.0);
    values[0] = 0.3;
    Frame bent;
    pose_from_channels(*glove, values, bent);
    bent.header.arrival_ns = 10;
    rig.glove(0, bent);
    rig.body(test::body_frame(*body, 1, 10));
    bent.header.arrival_ns = 20;
    rig.glove(0, bent);
    REQUIRE(rig.out.size() == 1);
    const auto hand = static_cast<std::size_t>(rig.skeleton->joint_of(Bone::kLeftHand));
    const auto turned = to_eigen_double(rig.out[0].frame.rotation_xyzw[hand]);
    const auto& above = rig.skeleton->joints[hand].parent;
    const Eigen::Quaterniond straight =
        rig.skeleton->joints[static_cast<std::size_t>(above)].T_world_joint.conjugate() *
        rig.skeleton->joints[hand].T_world_joint;
    const double expected = std::string_view(wrist) == "body" ? 0.0 : 0.3;
    const auto base = expected == 0.0 ? Eigen::Quaterniond::Identity() : straight;
    CHECK(angle_between_rad(base, turned) == Approx(expected).margin(1e-6));
  }
}

}  // namespace posed::merge
