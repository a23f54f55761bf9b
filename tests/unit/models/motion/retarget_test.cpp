// Retargeting: bones keep their directions on other axes, other proportions and with joints that
// only one of the two skeletons has; frames between two frames.
#include <catch2/catch.hpp>

#include "models/motion/interpolate.hpp"
#include "models/motion/kinematics.hpp"
#include "models/motion/retarget.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/allocations.hpp"

namespace posed::motion {
namespace {

clip::Clip short_walk() { return make_walker({.seconds = 1.0}).value(); }

// Half as tall, with every joint's axes turned, an additional joint below the hips, and without the
// shoulders.
std::shared_ptr<const Skeleton> turned_child(const Skeleton& walker) {
  auto child = std::make_shared<Skeleton>();
  child->name = "child";
  std::vector<int> place;  // [joint of the walker]
  for (const Joint& from : walker.joints) {
    const bool left_out = from.bone == Bone::kLeftShoulder || from.bone == Bone::kRightShoulder;
    const int parent = from.parent < 0 ? -1 : place[static_cast<std::size_t>(from.parent)];
    if (left_out) {
      place.push_back(parent);
      continue;
    }
    Joint joint = from;
    joint.parent = parent;
    const double angle = 0.3 * static_cast<double>(child->joints.size());
    joint.T_world_joint = axis_rotation(Axis::kX, angle) * axis_rotation(Axis::kY, 2 * angle);
    const Eigen::Quaterniond above =
        parent < 0 ? Eigen::Quaterniond::Identity()
                   : child->joints[static_cast<std::size_t>(parent)].T_world_joint;
    joint.offset_m = above.conjugate() * (0.5 * from.offset_m);
    place.push_back(static_cast<int>(child->joints.size()));
    child->joints.push_back(joint);
    if (from.bone == Bone::kHips) {
      Joint& belt = child->joints.emplace_back();
      belt.name = "belt";
      belt.parent = place.back();
      belt.T_world_joint = joint.T_world_joint;
      place.back() += 1;
    }
  }
  child->id = 1;
  return child;
}

// Rotation of a bone in the world relative to its T-pose.
Eigen::Quaterniond turn_of(const Skeleton& skeleton, const WorldPose& pose, Bone bone) {
  const auto joint = static_cast<std::size_t>(skeleton.joint_of(bone));
  return pose.rotation[joint] * skeleton.joints[joint].T_world_joint.conjugate();
}

}  // namespace

TEST_CASE("a retargeted walk keeps the direction of every bone, and comes back as it was") {
  const clip::Clip walk = short_walk();
  const auto child = turned_child(*walk.skeleton);
  const auto there = Retarget::bind(walk.skeleton, child).value();
  const auto back = Retarget::bind(child, walk.skeleton).value();
  CHECK(there.scale() == Approx(0.5));
  CHECK(back.scale() == Approx(2.0));
  Frame moved, returned;
  for (int i = 0; i < walk.frames(); i += 7) {
    const Frame frame = walk.frame(i);
    there.apply(frame, moved);
    const WorldPose before = world_pose(*walk.skeleton, frame);
    const WorldPose after = world_pose(*child, moved);
    for (const Joint& joint : child->joints) {
      if (!joint.bone) continue;
      CHECK(angle_between_rad(turn_of(*walk.skeleton, before, *joint.bone),
                              turn_of(*child, after, *joint.bone)) < 1e-5);
    }
    back.apply(moved, returned);
    CHECK(returned.root_position_m[1] == Approx(frame.root_position_m[1]).margin(1e-5));
    CHECK(returned.skeleton == walk.skeleton->id);
    const auto arm = static_cast<std::size_t>(walk.skeleton->joint_of(Bone::kLeftLowerArm));
    CHECK(angle_between_rad(to_eigen_double(returned.rotation_xyzw[arm]),
                            to_eigen_double(frame.rotation_xyzw[arm])) < 1e-5);
  }
}

TEST_CASE("a joint that the source lacks or did not measure follows its parent and is not valid") {
  const clip::Clip walk = short_walk();
  const auto child = turned_child(*walk.skeleton);
  const auto there = Retarget::bind(walk.skeleton, child).value();
  Frame frame = walk.frame(5), moved;
  const auto arm = static_cast<std::size_t>(walk.skeleton->joint_of(Bone::kLeftLowerArm));
  frame.valid[arm] = false;
  frame.quality = Quality::kPredicted;
  frame.lag_frames = 3;
  there.apply(frame, moved);
  const WorldPose after = world_pose(*child, moved);
  CHECK_FALSE(moved.valid[static_cast<std::size_t>(child->joint_index("belt"))]);
  CHECK_FALSE(moved.valid[static_cast<std::size_t>(child->joint_of(Bone::kLeftLowerArm))]);
  CHECK(moved.valid[static_cast<std::size_t>(child->joint_of(Bone::kLeftUpperArm))]);
  CHECK(angle_between_rad(turn_of(*child, after, Bone::kLeftLowerArm),
                          turn_of(*child, after, Bone::kLeftUpperArm)) < 1e-6);
  CHECK(moved.quality == Quality::kPredicted);
  CHECK(moved.lag_frames == 3);
}

TEST_CASE("retargeting between skeletons without a common bone is refused") {
  auto stick = std::make_shared<Skeleton>();
  stick->name = "stick";
  stick->joints.emplace_back().name = "end";
  const auto refused = Retarget::bind(short_walk().skeleton, stick);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.find("no bone in common") != std::string::npos);
}

TEST_CASE("retargeting and interpolating do not allocate, and angles follow the rotations") {
  const clip::Clip walk = short_walk();
  const auto same = Retarget::bind(walk.skeleton, walk.skeleton).value();
  const Frame a = walk.frame(3), b = walk.frame(4);
  Frame out = a, between = a;
  const std::uint64_t before = test::allocations();
  same.apply(b, out);
  interpolate(*walk.skeleton, a, b, 0.5, between);
  CHECK(test::allocations() == before);
  REQUIRE(out.angle_count == b.angle_count);
  for (std::size_t i = 0; i < out.angle_count; ++i) {
    CHECK(out.angle_rad[i] == Approx(b.angle_rad[i]).margin(1e-5));
    CHECK(between.angle_rad[i] == Approx((a.angle_rad[i] + b.angle_rad[i]) / 2).margin(1e-3));
  }
}

TEST_CASE("a joint that only one of two frames measured has that one's rotation") {
  const clip::Clip walk = short_walk();
  Frame a = walk.frame(3), b = walk.frame(9), out = a;
  a.valid[2] = false;
  b.valid[4] = false;
  interpolate(*walk.skeleton, a, b, 0.25, out);
  CHECK_FALSE(out.valid[2]);
  CHECK_FALSE(out.valid[4]);
  CHECK(out.valid[1]);
  CHECK(angle_between_rad(to_eigen_double(out.rotation_xyzw[2]),
                          to_eigen_double(b.rotation_xyzw[2])) < 1e-6);
  CHECK(angle_between_rad(to_eigen_double(out.rotation_xyzw[4]),
                          to_eigen_double(a.rotation_xyzw[4])) < 1e-6);
  CHECK(out.root_position_m[2] ==
        Approx(0.75 * a.root_position_m[2] + 0.25 * b.root_position_m[2]));
}

}  // namespace posed::motion
