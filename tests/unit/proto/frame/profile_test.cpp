#include <catch2/catch.hpp>

#include "proto/clip/figure.hpp"
#include "proto/frame/axes_text.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/profile.hpp"
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
  return skeleton;
}

}  // namespace

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
        "hand-left, hand-right, rokoko");
  CHECK(none.error().exit_code == ExitCode::kWrongUse);
  CHECK_FALSE(named_bones(profiles()[0], named({"Hips"})).has_value());
}

TEST_CASE("a profile that nobody named gives way where a joint of its bones is missing") {
  const Profile& profile = profiles()[0];
  std::vector<std::string> names;
  for (const auto& [joint, bone] : profile.bones) names.push_back(joint);
  names.insert(names.end(), profile.match.begin(), profile.match.end());
  const auto at_rest = [&] {
    Skeleton skeleton = named(names);
    for (const auto& [joint, axis] : profile.along) {
      Eigen::Vector3d& offset_m = skeleton.joints[skeleton.joint_index(joint)].offset_m;
      offset_m = (axis[0] == '-' ? -0.1 : 0.1) * Eigen::Vector3d::Unit(axis[1] - 'x');
    }
    return skeleton;
  };
  CHECK(find_profile(at_rest(), "").value().get() == &profile);
  CHECK(find_profile(named(names), "").value() == nullptr);  // they point another way
  std::erase(names, profile.bones.begin()->first);
  CHECK(find_profile(at_rest(), "").value() == nullptr);
}

TEST_CASE("axes text is read, and text that is not a rotation is refused") {
  const auto T = axes_from_text("+y-x+z");
  REQUIRE(T.has_value());
  CHECK((*T * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  CHECK((*T * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitX()));
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
  CHECK(angle_between_rad(T(Bone::kLeftToes), about_z(-20)) < 0.01 * kDegree);  // with the shin
  for (const Bone bone : {Bone::kHips, Bone::kUpperChest, Bone::kHead, Bone::kLeftUpperArm,
                          Bone::kRightLowerArm, Bone::kRightHand}) {
    CHECK(angle_between_rad(T(bone), about_z(0)) < 0.01 * kDegree);
  }
}

TEST_CASE("the recogniser finds the shipped frames of the Bandai figure by itself") {
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
    const auto picked =
        clip::sample_frames(clip->frames(), static_cast<int>(skeleton.joints.size()));
    const auto found = clip::recognise(skeleton, clip->channels(picked, Eigen::all), {});
    for (std::size_t j = 1; j < skeleton.joints.size(); ++j) {
      INFO(name << " " << skeleton.joints[j].name);
      CHECK(found.bone[j] == skeleton.joints[j].bone);
      const bool foot = skeleton.joints[j].name.starts_with("Foot") ||
                        skeleton.joints[j].name.starts_with("Toes");  // their slope is measured
      const double off_rad = angle_between_rad(found.T[j], skeleton.joints[j].T_world_joint);
      CHECK(off_rad < (foot ? 8 : 2) * kDegree);
    }
  }
}

}  // namespace posed
