#include "daemon/output/vmc_output.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>

#include <catch2/catch.hpp>

#include "drivers/vmc/emulator.hpp"
#include "drivers/vmc/osc.hpp"
#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/gltf.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::output {
namespace {

namespace vmc = drivers::vmc;

// As it is sent: Unity's axes.
struct SentBone {
  Vec3f position_m{};
  Quatf rotation_xyzw{};
};

// The bones of a writer's frame by name, and "root".
std::map<std::string, SentBone> sent_bones(const vmc::DatagramWriter& writer) {
  std::map<std::string, SentBone> bones;
  for (std::size_t i = 0; i < writer.datagrams(); ++i) {
    vmc::each_message(writer.datagram(i), [&](const vmc::OscMessage& message) {
      vmc::OscArguments arguments(message);
      SentBone& bone = bones[std::string(arguments.text())];
      for (float& x : bone.position_m) x = arguments.f32();
      for (float& x : bone.rotation_xyzw) x = arguments.f32();
      CHECK(arguments.ok());
    });
  }
  return bones;
}

std::map<std::string, SentBone> written(const Avatar& avatar) {
  vmc::DatagramWriter writer(vmc::Packing::kBundles);
  writer.start();
  avatar.write(writer);
  return sent_bones(writer);
}

std::shared_ptr<const Skeleton> shared_hand(Side side) {
  return std::make_shared<const Skeleton>(hand_skeleton(side));
}

Frame bent_hand(const Skeleton& skeleton, double flexion_rad) {
  HandAngles angles{};
  for (std::size_t joint = 3; joint < kHandJoints; ++joint) angles[3 * joint] = flexion_rad;
  Frame frame;
  set_hand_angles(skeleton, angles, frame);
  return frame;
}

double turn_rad(const Quatf& rotation) {
  return angle_between_rad(to_eigen_double(rotation), Eigen::Quaterniond::Identity());
}

}  // namespace

TEST_CASE("a flat hand is sent with identity rotations, a bent one turned about Unity's axes") {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const bool left = side == Side::kLeft;
    const std::string prefix = left ? "Left" : "Right";
    const auto skeleton = shared_hand(side);
    Avatar avatar(false);
    const Part part = left ? Part::kLeftHand : Part::kRightHand;
    REQUIRE(avatar.set_skeleton(part, skeleton));
    CHECK(written(avatar).empty());  // no pose yet
    REQUIRE(avatar.set_pose(part, bent_hand(*skeleton, 0.0)));
    const auto flat = written(avatar);
    CHECK(flat.size() == kHandJoints);  // neither wrist nor root
    for (const auto& [name, bone] : flat) {
      INFO(name);
      CHECK(name.starts_with(prefix));
      CHECK(turn_rad(bone.rotation_xyzw) < 1e-6);
    }
    // Unity's left hand points to -X: so do its fingers, one joint from the other.
    const Vec3f& next_m = flat.at(prefix + "IndexIntermediate").position_m;
    CHECK((left ? -next_m[0] : next_m[0]) > 0.02F);
    CHECK(std::abs(next_m[1]) < 1e-3F);

    REQUIRE(avatar.set_pose(part, bent_hand(*skeleton, 0.5)));
    const SentBone bent = written(avatar).at(prefix + "MiddleIntermediate");
    // The fingers bend down: about Unity's +Z on its left (-X to -Y), about -Z on its right.
    const float half = static_cast<float>(std::sin(0.25));
    CHECK(bent.rotation_xyzw[0] == Approx(0.0F).margin(1e-3));
    CHECK(bent.rotation_xyzw[1] == Approx(0.0F).margin(1e-3));
    CHECK(bent.rotation_xyzw[2] == Approx(left ? half : -half).margin(1e-3));
  }
}

TEST_CASE("with an avatar the lengths of its bones are sent, turned as the performer's are") {
  const clip::Clip walk = motion::make_walker({.seconds = 0.2}).value();
  const clip::Clip other = motion::make_walker({.person = 9, .seconds = 0.2}).value();
  const auto figure = motion::canonical_skeleton(*other.skeleton).value();
  Avatar plain(false), with_figure(false, figure);
  for (Avatar* avatar : {&plain, &with_figure}) {
    REQUIRE(avatar->set_skeleton(Part::kBody, walk.skeleton));
    REQUIRE(avatar->set_pose(Part::kBody, walk.frame(5)));
  }
  const auto own = written(plain), sent = written(with_figure);
  REQUIRE(sent.size() == own.size());
  double changed_m = 0.0;
  for (const auto& [name, bone] : sent) {
    INFO(name);
    CHECK(angle_between_rad(to_eigen_double(bone.rotation_xyzw),
                            to_eigen_double(own.at(name).rotation_xyzw)) < 1e-5);
    const Vec3f& before_m = own.at(name).position_m;
    for (std::size_t i = 0; i < 3; ++i) {
      changed_m =
          std::max(changed_m, std::abs(static_cast<double>(bone.position_m[i] - before_m[i])));
    }
  }
  const int shin = figure->joint_of(Bone::kLeftLowerLeg);
  const Eigen::Vector3d thigh_m = figure->joints[static_cast<std::size_t>(shin)].offset_m;
  CHECK(sent.at("LeftLowerLeg").position_m[1] == Approx(thigh_m.y()).margin(1e-5));
  CHECK(changed_m > 0.01);
}

TEST_CASE("an avatar's file is what its content says, whatever its name") {
  const test::TempFolder folder;
  const auto glb = folder.path() / "me.glb";
  REQUIRE(clip::write_glb(motion::make_walker({.seconds = 0.2}).value(), glb));
  const auto figure = avatar_figure(glb);
  REQUIRE(figure);
  for (const char* name : {"me.bvh", "me"}) {
    std::filesystem::copy_file(glb, folder.path() / name);
    const auto other = avatar_figure(folder.path() / name);
    INFO(name);
    if (!other) FAIL(other.error().text());
    CHECK((*other)->id == (*figure)->id);
  }
}

TEST_CASE("an avatar is turned from how its file rests, and stands on the floor of its file") {
  const clip::Clip walk = motion::make_walker({.seconds = 0.2}).value();
  // Its arms hang, and its soles are 8 cm thicker than its skeleton shows.
  auto figure = std::make_shared<Skeleton>(*motion::canonical_skeleton(*walk.skeleton).value());
  const double thicker_m = 0.08;
  const auto joint_of = [&](Bone bone) -> Joint& {
    return figure->joints[static_cast<std::size_t>(figure->joint_of(bone))];
  };
  double leg_m = 0.0;  // from the hips to the toes
  for (const Bone bone :
       {Bone::kLeftUpperLeg, Bone::kLeftLowerLeg, Bone::kLeftFoot, Bone::kLeftToes}) {
    leg_m -= joint_of(bone).offset_m.y();
  }
  const Frame pose = walk.frame(5);
  {  // Who has its very bones stands as it does.
    figure->joints[0].offset_m.y() = 1.02 * leg_m + thicker_m;
    Avatar same(false, std::make_shared<Skeleton>(*figure));
    REQUIRE(same.set_skeleton(Part::kBody, walk.skeleton));
    REQUIRE(same.set_pose(Part::kBody, pose));
    CHECK(written(same).at("Hips").position_m[1] == Approx(pose.root_position_m[1]).margin(1e-6));
  }
  joint_of(Bone::kHead).offset_m.y() += 0.03;
  const Eigen::Quaterniond hang = axis_rotation(Axis::kZ, -0.8);
  for (std::size_t j = 0; j < figure->joints.size(); ++j) {
    Joint& joint = figure->joints[j];
    for (std::optional<Bone> bone = joint.bone; bone; bone = parent_of(*bone)) {
      if (bone != Bone::kLeftUpperArm) continue;
      joint.T_world_joint = hang.conjugate();
      if (joint.bone != bone) joint.offset_m = hang * joint.offset_m;
    }
  }
  REQUIRE(figure->finish());
  const auto standing = std::make_shared<Skeleton>(*figure);
  figure->joints[0].offset_m.y() = 2.0;  // far from the floor, so nothing says where that is
  const auto heights = [&](double hips_m) {
    standing->joints[0].offset_m.y() = hips_m;
    std::array<double, 2> sent_m{};
    for (const auto& skeleton : {figure, standing}) {
      Avatar avatar(false, skeleton);
      REQUIRE(avatar.set_skeleton(Part::kBody, walk.skeleton));
      REQUIRE(avatar.set_pose(Part::kBody, pose));
      sent_m[skeleton == figure ? 0 : 1] = double(written(avatar).at("Hips").position_m[1]);
    }
    return sent_m;
  };
  const auto usual = heights(1.02 * leg_m), thick = heights(1.02 * leg_m + thicker_m);
  CHECK(usual[0] == Approx(static_cast<double>(pose.root_position_m[1])).margin(1e-5));
  CHECK(usual[1] == Approx(usual[0]).margin(1e-5));
  CHECK(thick[1] == Approx(usual[0] + thicker_m).margin(1e-5));

  Avatar plain(false), hanging(false, standing);
  for (Avatar* avatar : {&plain, &hanging}) {
    REQUIRE(avatar->set_skeleton(Part::kBody, walk.skeleton));
    REQUIRE(avatar->set_pose(Part::kBody, pose));
  }
  const auto own = written(plain), sent = written(hanging);
  // As sent, in Unity's axes: the bone's place is that of the file, its direction the performer's.
  const Eigen::Vector3d rest = joint_of(Bone::kLeftLowerArm).offset_m;
  CHECK(sent.at("LeftLowerArm").position_m[1] == Approx(rest.y()).margin(1e-5));
  const auto elbow = [](const std::map<std::string, SentBone>& bones) {
    Eigen::Quaterniond world = Eigen::Quaterniond::Identity();
    for (const char* name :
         {"Hips", "Spine", "Chest", "UpperChest", "LeftShoulder", "LeftUpperArm"}) {
      const auto bone = bones.find(name);
      if (bone != bones.end()) world = world * to_eigen_double(bone->second.rotation_xyzw);
    }
    const Vec3f& at_m = bones.at("LeftLowerArm").position_m;
    return Eigen::Vector3d(world * Eigen::Vector3f(at_m.data()).cast<double>());
  };
  CHECK((elbow(sent) - elbow(own)).norm() < 1e-4);
}

TEST_CASE("a hand's stream replaces the fingers of the body and leaves its wrist alone") {
  const clip::Clip walk = motion::make_walker({.seconds = 0.2}).value();
  const auto hand = shared_hand(Side::kLeft);
  Avatar avatar(false);
  REQUIRE(avatar.set_skeleton(Part::kBody, walk.skeleton));
  REQUIRE(avatar.set_pose(Part::kBody, walk.frame(2)));
  const auto alone = written(avatar);
  CHECK(alone.contains("root"));
  CHECK(alone.contains("Hips"));
  REQUIRE(avatar.set_skeleton(Part::kLeftHand, hand));
  REQUIRE(avatar.set_pose(Part::kLeftHand, bent_hand(*hand, 0.5)));
  const auto both = written(avatar);
  int fingers = 0;
  for (const auto& [name, bone] : both) {
    INFO(name);
    const auto before = alone.find(name);
    if (before != alone.end()) {
      CHECK(before->second.rotation_xyzw == bone.rotation_xyzw);
    } else {
      CHECK(name.starts_with("Left"));
      ++fingers;
    }
  }
  CHECK(fingers == kHandJoints);
  // It leaves.
  REQUIRE(avatar.set_skeleton(Part::kLeftHand, nullptr));
  CHECK(written(avatar).size() == alone.size());
  CHECK_FALSE(avatar.set_pose(Part::kLeftHand, bent_hand(*hand, 0.5)));
}

TEST_CASE("an assistant's avatar has hands only") {
  const vmc::VmcEmulator emulator(60.0, vmc::Packing::kOneBundle);  // has every bone
  const auto person = std::make_shared<const Skeleton>(*emulator.skeleton(0));
  Frame frame;
  frame.joint_count = static_cast<std::uint16_t>(person->joints.size());
  frame.rotation_xyzw.fill(kIdentity);
  frame.valid.set();
  Avatar performer(false);
  REQUIRE(performer.set_skeleton(Part::kBody, person));
  REQUIRE(performer.set_pose(Part::kBody, frame));
  CHECK(written(performer).size() == kBones + 1);  // and the root
  Avatar assistant(true);
  REQUIRE(assistant.set_skeleton(Part::kBody, person));
  REQUIRE(assistant.set_pose(Part::kBody, frame));
  const auto bones = written(assistant);
  CHECK(bones.size() == 2 * (1 + kHandJoints));
  CHECK(bones.contains("LeftHand"));
  CHECK(bones.contains("RightThumbProximal"));
  CHECK_FALSE(bones.contains("root"));
  Skeleton armless;
  armless.name = "armless";
  armless.joints.emplace_back().name = "hips";
  REQUIRE(armless.finish());
  const auto refused =
      assistant.set_skeleton(Part::kBody, std::make_shared<const Skeleton>(armless));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.find("no bones of a hand") != std::string::npos);
}

TEST_CASE("a skeleton that cannot move its part is refused in one sentence") {
  Avatar avatar(false);
  const auto body = avatar.set_skeleton(Part::kBody, shared_hand(Side::kLeft));
  REQUIRE_FALSE(body);
  CHECK(body.error().message.find("has no hips") != std::string::npos);
  const auto wrong = avatar.set_skeleton(Part::kRightHand, shared_hand(Side::kLeft));
  REQUIRE_FALSE(wrong);
  CHECK(wrong.error().message.find("has no rightHand") != std::string::npos);
  const auto walk = motion::make_walker({.seconds = 0.2}).value();
  const auto without = avatar.set_skeleton(Part::kRightHand, walk.skeleton);
  REQUIRE_FALSE(without);
  CHECK(without.error().message.find("no bones of a right hand") != std::string::npos);
  CHECK(written(avatar).empty());
}

TEST_CASE("blend shapes go out under the names of the wanted version") {
  CHECK(preset_name("Joy", VrmNames::kVrm0) == "Joy");
  CHECK(preset_name("Joy", VrmNames::kVrm1) == "happy");
  CHECK(preset_name("blinkLeft", VrmNames::kVrm0) == "Blink_L");
  CHECK(preset_name("jawOpen", VrmNames::kVrm1) == "jawOpen");
  BlendShapes shapes(VrmNames::kVrm1);
  CHECK(shapes.set_layout({.names = {"Joy", "tra/1/x", "bend", "jawOpen", "A", ""},
                           .units = {"1", "1", "rad", "1", "1", "1"}}) == 1);
  vmc::DatagramWriter writer(vmc::Packing::kMessages);
  writer.start();
  shapes.write(writer);
  CHECK(writer.datagrams() == 1);  // some receivers move their bones only at Apply
  writer.start();
  Sample sample;
  sample.value_count = 5;
  sample.value = {0.25F, 9.0F, 9.0F, 0.5F, 0.75F};
  sample.valid.set(0).set(1).set(2).set(3);  // A was not measured
  shapes.update(sample);
  shapes.write(writer);
  std::string text;
  for (std::size_t i = 0; i < writer.datagrams(); ++i) {
    vmc::each_message(writer.datagram(i), [&](const vmc::OscMessage& message) {
      vmc::OscArguments arguments(message);
      text += message.address;
      if (!message.types.empty()) {
        text += " " + std::string(arguments.text());
        text += " " + std::to_string(arguments.f32());
      }
      text += "\n";
    });
  }
  CHECK(text ==
        "/VMC/Ext/Blend/Val happy 0.250000\n/VMC/Ext/Blend/Val jawOpen 0.500000\n"
        "/VMC/Ext/Blend/Apply\n");
  // More names than a frame has room for: the last ones are left out and counted.
  drivers::SampleLayout many;
  for (int i = 0; i < 200; ++i) {
    many.names.push_back(std::to_string(i) + std::string(100, 'x'));
    many.units.emplace_back("1");
  }
  const std::size_t left_out = shapes.set_layout(many);
  CHECK(left_out > 50);
  CHECK(left_out < 150);
}

}  // namespace posed::output
