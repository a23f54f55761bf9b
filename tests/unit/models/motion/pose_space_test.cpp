// Pose spaces: conversion both ways, heading, missing joints, and bits that must not change.
#include "models/motion/pose_space.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <numbers>

#include "models/motion/cmu43.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/rotation.hpp"

using namespace posed;
using namespace posed::motion;
using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

Motion walker() {
  auto clip = make_walker({.seconds = 1.0});
  REQUIRE(clip.has_value());
  return std::move(*motion_of(*clip));
}

// A figure with the joints of the CMU skeleton, as an .asf or as the BVH made from one.
Skeleton cmu(bool acclaim) {
  Skeleton skeleton;
  skeleton.name = acclaim ? "asf" : "bvh";
  for (const Cmu43Joint& entry : kCmu43) {
    Joint joint;
    joint.name = acclaim ? entry.asf : entry.bvh;
    joint.parent = skeleton.joints.empty() ? -1 : 0;
    joint.offset_m = Vector3d(0.1, 0.1, 0.0);
    if (acclaim) joint.channel_frame = cmu43_axis_frame(entry);
    for (const Axis axis : {Axis::kZ, Axis::kY, Axis::kX}) {
      skeleton.channels.push_back(
          {.joint = static_cast<std::uint16_t>(skeleton.joints.size()), .axis = axis});
    }
    skeleton.joints.push_back(joint);
  }
  REQUIRE(skeleton.finish().has_value());
  return skeleton;
}

struct Vectors {
  std::vector<float> q;
  std::vector<std::uint8_t> available;
};

Vectors vector_of(const PoseSpace& space, const Frame& frame, double heading_rad) {
  Vectors v{std::vector<float>(space.dims()), std::vector<std::uint8_t>(space.dims())};
  space.to_vector(frame, heading_rad, v.q, v.available);
  return v;
}

}  // namespace

TEST_CASE("Adding a change moves q by exactly that change, in every space", "[pose_space]") {
  const Motion walk = walker();
  for (const Space which : {Space::kNative, Space::kHumanoid}) {
    auto spec = describe_space(which, *walk.skeleton);
    REQUIRE(spec.has_value());
    for (std::size_t i = 0; i < spec->mean.size(); ++i) {
      spec->mean[i] = rotation_exp(Vector3d(0.1 * std::sin(i), 0.2, -0.1));
    }
    const auto space = PoseSpace::bind(*spec, *walk.skeleton);
    REQUIRE(space.has_value());
    CHECK(space->dims() == 3 * 21);
    Frame frame = walk.frames[11];
    const auto before = vector_of(*space, frame, 0.4);
    std::vector<float> delta(space->dims());
    for (int d = 0; d < space->dims(); ++d) delta[d] = 0.1F * std::cos(static_cast<float>(d));
    space->add(frame, 0.4, before.q, delta);
    const auto after = vector_of(*space, frame, 0.4);
    for (int d = 0; d < space->dims(); ++d) {
      CHECK(after.q[d] == Approx(before.q[d] + delta[d]).margin(2e-6));
    }
    // The channel angles give the same pose as the rotations.
    Frame again = frame;
    std::vector<double> channels;
    for (const float p : frame.root_position_m) channels.push_back(p);
    for (int a = 0; a < frame.angle_count; ++a) channels.push_back(frame.angle_rad[a]);
    pose_from_channels(*walk.skeleton, channels, again);
    for (int j = 0; j < frame.joint_count; ++j) {
      CHECK(angle_between_rad(to_eigen_double(again.rotation_xyzw[j]),
                              to_eigen_double(frame.rotation_xyzw[j])) < 1e-5);
    }
  }
}

TEST_CASE("A zero change and a missing joint leave every bit unchanged", "[pose_space]") {
  const Motion walk = walker();
  const auto spec = describe_space(Space::kNative, *walk.skeleton);
  const auto space = PoseSpace::bind(*spec, *walk.skeleton);
  REQUIRE(space.has_value());
  Frame frame = walk.frames[3];
  frame.valid.reset(6);
  const Frame before = frame;
  const auto v = vector_of(*space, frame, 0.2);
  CHECK(v.available[3 * 6] == 0);
  CHECK(v.q[3 * 6] == 0.0F);
  CHECK(v.available[3 * 5] == 1);
  std::vector<float> delta(space->dims(), 0.0F);
  space->add(frame, 0.2, v.q, delta);
  CHECK(std::memcmp(&frame, &before, sizeof(Frame)) == 0);
  delta[3 * 6] = 0.3F;
  space->add(frame, 0.2, v.q, delta);
  CHECK(std::memcmp(&frame, &before, sizeof(Frame)) == 0);
}

TEST_CASE("The heading is removed: a turned walker has the same q", "[pose_space]") {
  const Motion walk = walker();
  for (const Space which : {Space::kNative, Space::kHumanoid}) {
    const auto spec = describe_space(which, *walk.skeleton);
    const auto space = PoseSpace::bind(*spec, *walk.skeleton);
    Frame frame = walk.frames[7];
    const double heading = space->heading_rad(frame);
    const auto before = vector_of(*space, frame, heading);
    CHECK(before.q[1] == Approx(0.0).margin(0.03));
    for (const double turn_rad : {0.5, 2.0, -3.0}) {
      Frame other = frame;
      other.rotation_xyzw[0] =
          from_eigen(axis_rotation(Axis::kY, turn_rad) * to_eigen_double(frame.rotation_xyzw[0]));
      const double found = space->heading_rad(other);
      CHECK(std::remainder(found - heading - turn_rad, 2 * std::numbers::pi) ==
            Approx(0.0).margin(1e-6));
      const auto after = vector_of(*space, other, found);
      for (int d = 0; d < space->dims(); ++d) CHECK(after.q[d] == Approx(before.q[d]).margin(1e-5));
    }
  }
}

TEST_CASE("cmu43 reads the same angles from an ASF figure and from its BVH", "[pose_space]") {
  const Skeleton asf = cmu(true);
  const Skeleton bvh = cmu(false);
  const auto spec = describe_space(Space::kCmu43, asf);
  REQUIRE(spec.has_value());
  CHECK(space_dims(*spec) == 43);
  const auto from_asf = PoseSpace::bind(*spec, asf);
  const auto from_bvh = PoseSpace::bind(*spec, bvh);
  REQUIRE(from_asf.has_value());
  REQUIRE(from_bvh.has_value());
  CHECK(from_asf->dims() == 43);
  Frame frame;
  frame.joint_count = 19;
  frame.valid.set();
  for (int j = 0; j < 19; ++j) {
    const auto c = cmu43_axis_frame(kCmu43[j]);
    Vector3d angle(0.3 * std::cos(j), 0.4 * std::sin(j), 0.2);
    for (int a = 0; a < 3; ++a) {
      if (((kCmu43[j].axes >> a) & 1) == 0) angle[a] = 0.0;
    }
    frame.rotation_xyzw[j] = from_eigen(c * rotation_from_euler_xyz(angle) * c.conjugate());
  }
  const auto v = vector_of(*from_asf, frame, 0.0);
  CHECK(v.q == vector_of(*from_bvh, frame, 0.0).q);
  CHECK(v.q[3] == Approx(0.3 * std::cos(1.0)).margin(1e-6));    // lowerback about x
  CHECK(v.q[42] == Approx(0.3 * std::cos(18.0)).margin(1e-6));  // the left toes
  std::vector<float> delta(43, 0.05F);
  Frame moved = frame;
  from_asf->add(moved, 0.0, v.q, delta);
  const auto after = vector_of(*from_asf, moved, 0.0);
  for (int d = 0; d < 43; ++d) CHECK(after.q[d] == Approx(v.q[d] + 0.05).margin(1e-5));
}

TEST_CASE("Near the pole of its Euler angles a cmu43 joint still moves by a small turn",
          "[pose_space]") {
  const Skeleton asf = cmu(true);
  const auto space = PoseSpace::bind(*describe_space(Space::kCmu43, asf), asf);
  Frame frame;
  frame.joint_count = 19;
  frame.valid.set();
  frame.rotation_xyzw.fill(kIdentity);
  const double close = 89.9 * std::numbers::pi / 180.0;
  frame.rotation_xyzw[1] = from_eigen(rotation_from_euler_xyz({0.3, close, -0.8}));
  const auto v = vector_of(*space, frame, 0.0);
  std::vector<float> delta(43, 0.0F);
  delta[3] = 0.1F;
  delta[4] = 0.1F;
  Frame moved = frame;
  space->add(moved, 0.0, v.q, delta);
  const double turn = angle_between_rad(to_eigen_double(frame.rotation_xyzw[1]),
                                        to_eigen_double(moved.rotation_xyzw[1]));
  CHECK(turn > 0.05);
  CHECK(turn < 0.2);
}

TEST_CASE("A person who lacks a limb, chest, shoulders and toes is styled as one who has them",
          "[pose_space]") {
  const auto arm_lost = GENERATE(false, true);
  const Motion walk = walker();
  auto spec = describe_space(Space::kHumanoid, *walk.skeleton);
  REQUIRE(spec.has_value());
  for (std::size_t i = 0; i < spec->mean.size(); ++i) {
    spec->mean[i] = rotation_exp(Vector3d(0.1 * std::sin(i), 0.2, -0.1));
  }
  Skeleton lacking = *walk.skeleton;
  std::vector lost_bones{Bone::kChest, Bone::kLeftShoulder, Bone::kRightShoulder, Bone::kLeftToes};
  if (arm_lost) {
    lost_bones.insert(lost_bones.end(), {Bone::kLeftUpperArm, Bone::kLeftLowerArm, Bone::kLeftHand,
                                         Bone::kRightLowerLeg, Bone::kRightFoot, Bone::kRightToes});
  }
  int lost = 0;
  for (const Bone bone : lost_bones) {
    const int joint = lacking.joint_of(bone);
    if (joint < 0) continue;
    lacking.joints[joint].bone.reset();
    ++lost;
  }
  REQUIRE(lost > 0);
  const auto whole = PoseSpace::bind(*spec, *walk.skeleton);
  REQUIRE_FALSE(PoseSpace::bind(*spec, lacking).has_value());
  const auto rest = PoseSpace::bind_person(*spec, lacking);
  REQUIRE(rest.has_value());
  CHECK(static_cast<int>(rest->missing().size()) == lost);

  // The missing joints stand as in the training's mean, which is what the rest has to assume.
  std::vector<double> q(whole->dims());
  std::vector<float> delta(whole->dims());
  for (int d = 0; d < whole->dims(); ++d) {
    const bool is_there = rest->skeleton_joint_of_dim(d) >= 0;
    q[d] = is_there ? 0.2 * std::sin(3.0 * d) : 0.0;
    delta[d] = static_cast<float>(0.15 * std::cos(2.0 * d));
  }
  Frame frame = walk.frames[0];
  whole->put(frame, 0.3, q);
  const auto seen = vector_of(*rest, frame, 0.3);
  const auto seen_whole = vector_of(*whole, frame, 0.3);
  for (int d = 0; d < rest->dims(); ++d) {
    CHECK((seen.available[d] != 0) == (rest->skeleton_joint_of_dim(d) >= 0));
    CHECK(seen.q[d] == Approx(seen_whole.q[d]).margin(1e-5));
  }
  Frame expected = frame;
  Frame styled = frame;
  whole->add(expected, 0.3, seen_whole.q, delta);
  rest->add(styled, 0.3, seen.q, delta);
  const auto world = [&](const Frame& of, int joint) {
    Quaterniond rotation = Quaterniond::Identity();
    for (int j = joint; j >= 0; j = lacking.joints[j].parent) {
      rotation = to_eigen_double(of.rotation_xyzw[j]) * rotation;
    }
    return rotation;
  };
  for (int j = 0; j < static_cast<int>(lacking.joints.size()); ++j) {
    if (!lacking.joints[j].bone) continue;
    INFO(lacking.joints[j].name);
    CHECK(angle_between_rad(world(styled, j), world(expected, j)) < 1e-4);
  }
  CHECK(is_person(lacking));
  for (const Bone bone : {Bone::kLeftLowerArm, Bone::kRightLowerArm}) {
    if (const int joint = lacking.joint_of(bone); joint >= 0) lacking.joints[joint].bone.reset();
  }
  CHECK_FALSE(is_person(lacking));
  const auto refused = PoseSpace::bind_person(*spec, lacking);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("leftLowerArm") != std::string::npos);
}

TEST_CASE("A skeleton that cannot serve is refused with the missing joints", "[pose_space]") {
  const Motion walk = walker();
  auto spec = describe_space(Space::kNative, *walk.skeleton);
  spec->joints[4] = "Tail";
  const auto refused = PoseSpace::bind(*spec, *walk.skeleton);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("Tail") != std::string::npos);
  const auto acclaim = describe_space(Space::kCmu43, *walk.skeleton);
  REQUIRE_FALSE(acclaim.has_value());
  CHECK(acclaim.error().message.find("lhumerus") != std::string::npos);
  CHECK(space_from_name("humanoid").value() == Space::kHumanoid);
  const auto unknown = space_from_name("humanoids");
  REQUIRE_FALSE(unknown.has_value());
  CHECK(unknown.error().exit_code == ExitCode::kWrongUse);
}
