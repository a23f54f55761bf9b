#include <catch2/catch.hpp>

#include <functional>
#include <limits>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/message/skeleton_message.hpp"

namespace posed::message {
namespace {

// Hips, chest and a turned arm, with channels.
Skeleton toy() {
  Skeleton skeleton;
  skeleton.name = "toy";
  skeleton.joints.resize(3);
  skeleton.joints[0].name = "Hips";
  skeleton.joints[0].bone = Bone::kHips;
  skeleton.joints[1].name = "Spine";
  skeleton.joints[1].parent = 0;
  skeleton.joints[1].offset_m = {0.0, 0.5, 0.0};
  skeleton.joints[2].name = "LeftArm";
  skeleton.joints[2].parent = 1;
  skeleton.joints[2].offset_m = {0.25, 0.125, 0.0};
  skeleton.joints[2].end_site_m = Eigen::Vector3d(0.5, 0.0, 0.0);
  skeleton.channels = {{.joint = 0, .axis = Axis::kX, .translation = true},
                       {.joint = 0, .axis = Axis::kZ},
                       {.joint = 2, .axis = Axis::kY}};
  skeleton.capsules = {
      {.joint = 2, .from_m = {0.0, 0.5, 0.0}, .to_m = {0.25, 0.0, 0.0}, .radius_m = 0.125}};
  REQUIRE(skeleton.finish());
  return skeleton;
}

TEST_CASE("a skeleton comes back from its message") {
  const Skeleton sent = toy();
  const v1::Skeleton message = skeleton_message("ann", sent, 60.0);
  CHECK(message.stream() == "ann");
  CHECK(message.rate_hz() == 60.0);
  const auto got = skeleton_from(message).value();
  CHECK(got->name == sent.name);
  REQUIRE(got->joints.size() == sent.joints.size());
  for (std::size_t j = 0; j < sent.joints.size(); ++j) {
    CHECK(got->joints[j].name == sent.joints[j].name);
    CHECK(got->joints[j].parent == sent.joints[j].parent);
    CHECK(got->joints[j].offset_m == sent.joints[j].offset_m);
    CHECK(got->joints[j].end_site_m == sent.joints[j].end_site_m);
    CHECK(got->joints[j].bone == sent.joints[j].bone);
    CHECK(got->joints[j].T_world_joint.angularDistance(sent.joints[j].T_world_joint) < 1e-6);
  }
  REQUIRE(got->capsules.size() == 1);
  CHECK(got->capsules[0].joint == 2);
  CHECK(got->capsules[0].from_m == sent.capsules[0].from_m);
  CHECK(got->capsules[0].to_m == sent.capsules[0].to_m);
  CHECK(got->capsules[0].radius_m == 0.125);
  REQUIRE(got->channels.size() == 2);  // of rotations alone
  CHECK(got->channels[1].joint == 2);
  CHECK(got->channels[1].axis == Axis::kY);
}

TEST_CASE("posed's own hands come back complete") {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const Skeleton hand = hand_skeleton(side);
    const auto got = skeleton_from(skeleton_message("right", hand, 100.0)).value();
    CHECK(got->id == hand.id);
    CHECK(hand_side(*got) == side);
  }
}

TEST_CASE("a damaged skeleton message is refused in one sentence") {
  const v1::Skeleton good = skeleton_message("ann", toy(), 60.0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::function<void(v1::Skeleton&)>> damages{
      [](v1::Skeleton& m) { m.clear_joint_name(); },
      [](v1::Skeleton& m) { m.add_capsule_joint(0); },
      [](v1::Skeleton& m) { m.set_capsule_joint(0, 3); },
      [&](v1::Skeleton& m) { m.set_capsule_m(0, nan); },
      [&](v1::Skeleton& m) { m.set_capsule_m(6, nan); },
      [](v1::Skeleton& m) { m.add_joint_name("more"); },
      [](v1::Skeleton& m) { m.add_parent(0); },
      [](v1::Skeleton& m) { m.set_parent(1, 1); },
      [](v1::Skeleton& m) { m.set_parent(1, -1); },
      [](v1::Skeleton& m) { m.set_parent(0, 2); },
      [](v1::Skeleton& m) { m.add_offset_m(0.0F); },
      [&](v1::Skeleton& m) { m.set_offset_m(4, nan); },
      [](v1::Skeleton& m) { m.set_offset_m(4, 1e6F); },
      [](v1::Skeleton& m) { m.add_end_site_m(0.0F); },
      [](v1::Skeleton& m) { m.set_end_site_m(8, 1e6F); },
      [&](v1::Skeleton& m) { m.set_end_site_m(8, nan); },
      [](v1::Skeleton& m) { m.add_humanoid_bone("head"); },
      [](v1::Skeleton& m) { m.set_t_world_joint_xyzw(3, 0.0F); },
      [&](v1::Skeleton& m) { m.set_t_world_joint_xyzw(3, nan); },
      [](v1::Skeleton& m) { m.clear_t_world_joint_xyzw(); },
      [](v1::Skeleton& m) { m.set_channel_joint(0, 3); },
      [](v1::Skeleton& m) { m.set_channel_joint(1, 0xFFFF'FFFF); },
      [](v1::Skeleton& m) { m.set_channel_axis("zw"); },
      [](v1::Skeleton& m) { m.set_channel_axis("z"); },
      [](v1::Skeleton& m) { m.set_root_joint(3); },
      [](v1::Skeleton& m) { m.set_joint_name(1, "Hips"); },
      [](v1::Skeleton& m) {
        for (int i = 0; i < 100; ++i) {
          m.add_joint_name(std::to_string(i));
          m.add_parent(0);
        }
      }};
  for (std::size_t i = 0; i < damages.size(); ++i) {
    INFO(i);
    v1::Skeleton bad = good;
    damages[i](bad);
    const auto refused = skeleton_from(bad);
    REQUIRE_FALSE(refused);
    CHECK_FALSE(refused.error().message.contains('\n'));
  }
  CHECK(skeleton_from(good));
}

}  // namespace
}  // namespace posed::message
