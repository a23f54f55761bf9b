#include <catch2/catch.hpp>

#include "proto/clip/draft.hpp"
#include "proto/frame/bone_names.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/profile.hpp"
#include "proto/frame/t_pose.hpp"
#include "tests/support/shared.hpp"

namespace posed {
namespace {

Skeleton named(const std::vector<std::string>& names) {
  Skeleton skeleton;
  for (std::size_t j = 0; j < names.size(); ++j) {
    Joint joint;
    joint.name = names[j];
    joint.parent = static_cast<int>(j) - 1;
    joint.offset_m = Eigen::Vector3d(0, 0.1, 0);
    skeleton.joints.push_back(std::move(joint));
  }
  name_bones(skeleton);
  return skeleton;
}

void check_bone(const Skeleton& skeleton, const std::string& joint, std::string_view bone) {
  INFO(joint);
  const auto& found = skeleton.joints[skeleton.joint_index(joint)].bone;
  CHECK((found ? bone_name(*found) : std::string_view()) == bone);
}

}  // namespace

TEST_CASE("joint names of many programs are understood") {
  const Skeleton mixamo =
      named({"mixamorig:Hips", "mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2",
             "mixamorig:Neck", "mixamorig:Head", "mixamorig:LeftShoulder", "mixamorig:LeftArm",
             "mixamorig:LeftForeArm", "mixamorig:LeftHand", "mixamorig:LeftHandThumb1",
             "mixamorig:LeftHandPinky3", "mixamorig:RightUpLeg", "mixamorig:RightToeBase"});
  check_bone(mixamo, "mixamorig:Spine2", "upperChest");
  check_bone(mixamo, "mixamorig:LeftArm", "leftUpperArm");
  check_bone(mixamo, "mixamorig:LeftHandThumb1", "leftThumbMetacarpal");
  check_bone(mixamo, "mixamorig:LeftHandPinky3", "leftLittleDistal");
  check_bone(mixamo, "mixamorig:RightUpLeg", "rightUpperLeg");
  check_bone(mixamo, "mixamorig:RightToeBase", "rightToes");
  const Skeleton neuron = named({"Hips", "Spine", "Spine1", "Spine2", "Spine3", "RightInHandIndex",
                                 "RightHandIndex1", "RightHandIndex2"});
  check_bone(neuron, "Spine1", "chest");
  check_bone(neuron, "Spine2", "");
  check_bone(neuron, "Spine3", "upperChest");
  check_bone(neuron, "RightInHandIndex", "");
  check_bone(neuron, "RightHandIndex2", "rightIndexIntermediate");
  const Skeleton acclaim = named({"root", "lhipjoint", "lfemur", "lwrist", "lhand", "rclavicle"});
  check_bone(acclaim, "root", "hips");
  check_bone(acclaim, "lhipjoint", "");
  check_bone(acclaim, "lwrist", "leftHand");
  check_bone(acclaim, "lhand", "");
  check_bone(acclaim, "rclavicle", "rightShoulder");
  const Skeleton suffixed = named({"joint_Root", "Hips", "UpperArm_L", "thigh.R", "Toes_R"});
  check_bone(suffixed, "joint_Root", "");
  check_bone(suffixed, "UpperArm_L", "leftUpperArm");
  check_bone(suffixed, "thigh.R", "rightUpperLeg");
  const Skeleton collars = named({"hip", "leftCollar", "leftShoulder", "leftElbow", "leftHip"});
  check_bone(collars, "hip", "hips");
  check_bone(collars, "leftShoulder", "leftUpperArm");
  check_bone(collars, "leftHip", "leftUpperLeg");
  const Skeleton odd = named({"L", "\xE8\x85\xB0", "__", "r_", "left", "R."});
  CHECK(odd.joint_of(Bone::kHips) == -1);
}

TEST_CASE("every built-in profile is valid, and an invalid one is refused with its line") {
  REQUIRE(profiles().size() >= 4);
  const auto error = [](const std::string& text) {
    const auto profile = parse_profile(text, "p.toml");
    REQUIRE_FALSE(profile.has_value());
    return profile.error().text();
  };
  CHECK(error("name = 1 2").starts_with("p.toml:1: "));
  CHECK(error("name = \"p\"\n[bones]\n[size]\n").starts_with("p.toml:3: unknown key 'size'"));
  CHECK(error("name = \"p\"\n") ==
        "p.toml:1: bones is missing; a profile names the joints of canonical bones");
  CHECK(
      error("name = \"p\"\n[bones]\nhip = \"a\"\n").starts_with("p.toml:3: 'hip' is no canonical"));
  CHECK(error("name = \"p\"\n[bones]\nhips = \"a\"\n[T]\na = \"+x+x+z\"\n")
            .starts_with("p.toml:5: T "));
  const auto none = find_profile(named({"a"}), "bandy");
  REQUIRE_FALSE(none.has_value());
  CHECK(none.error().text() ==
        "there is no skeleton profile 'bandy'; there are bandai, cmu-asf, cmu-axes, cmu-bvh, "
        "hand-left, hand-right");
  CHECK(none.error().exit_code == ExitCode::kWrongUse);
  Skeleton other = named({"Hips"});
  CHECK_FALSE(name_bones(profiles()[0], other).has_value());
}

TEST_CASE("axes text is converted both ways, and text that is not a rotation is refused") {
  for (const char* text : {"+x+y+z", "+y-x+z", "-z+x-y", "+x-y-z"}) {
    const auto T = axes_from_text(text);
    REQUIRE(T.has_value());
    CHECK(axes_text(*T) == text);
  }
  for (const char* text : {"", "+x+y", "+x+x+z", "-x+y+z", "+x+y+w", "xxyyzz"}) {
    CHECK_FALSE(axes_from_text(text).has_value());
  }
}

TEST_CASE("T of a CMU figure: legs turned 20 degrees, arms and trunk not at all") {
  const auto path = test::shared("data/cmu/07_01.bvh");
  if (!path) {
    SKIP_WITHOUT_SHARED();
  }
  const auto clip = clip::read_clip(*path);
  if (!clip) FAIL(clip.error().text());
  CHECK(clip->warnings.empty());
  const auto T = [&clip](Bone bone) {
    return clip->skeleton->joints[clip->skeleton->joint_of(bone)].T_world_joint;
  };
  const auto about_z = [](double angle_deg) {
    return axis_rotation(Axis::kZ, angle_deg * kDegree);
  };
  CHECK(angle_between_rad(T(Bone::kLeftLowerLeg), about_z(-20)) < 0.01 * kDegree);
  CHECK(angle_between_rad(T(Bone::kRightUpperLeg), about_z(20)) < 0.01 * kDegree);
  CHECK(angle_between_rad(T(Bone::kLeftToes), about_z(-20)) < 0.01 * kDegree);
  for (const Bone bone : {Bone::kHips, Bone::kUpperChest, Bone::kHead, Bone::kLeftUpperArm,
                          Bone::kRightLowerArm, Bone::kRightHand}) {
    CHECK(angle_between_rad(T(bone), about_z(0)) < 0.01 * kDegree);
  }
}

TEST_CASE("the rule for folded zero poses finds the shipped frames of the Bandai figure") {
  for (const char* name :
       {"walk_feminine_001", "walk_masculine_002", "walk_normal_001", "run_normal_002"}) {
    const auto path = test::shared(std::string("data/styles/dataset-2_") + name + ".bvh");
    if (!path) {
      SKIP_WITHOUT_SHARED();
    }
    const auto clip = clip::read_clip(*path);
    if (!clip) FAIL(clip.error().text());
    CHECK(clip->metres_per_unit == 0.01);
    CHECK(clip->warnings.empty());
    const Skeleton& skeleton = *clip->skeleton;
    CHECK_FALSE(zero_pose_is_t(skeleton));
    const KnownT found = t_frames_from_mean_pose(skeleton, clip::mean_rotations(*clip));
    for (std::size_t j = 1; j < skeleton.joints.size(); ++j) {
      INFO(name << " " << skeleton.joints[j].name);
      CHECK(axes_text(*found[j]) == axes_text(skeleton.joints[j].T_world_joint));
    }
  }
}

}  // namespace posed
