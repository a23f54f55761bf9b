// What a viewer shows of a .glb and of a .vrma is the motion of the clip.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <span>

#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/kinematics.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/motion/vrm_animation.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/gltf.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/read_gltf.hpp"
#include "tests/support/same_motion.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::motion {
namespace {

constexpr double kSame_m = 1e-5;

clip::Clip walker_clip() { return make_walker({.seconds = 1.0, .rate_hz = 60.0}).value(); }

void check_glb(const clip::Clip& clip) {
  const test::TempFolder folder;
  const auto path = folder.path() / "out.glb";
  REQUIRE(clip::write_glb(clip, path));
  const test::ReadGltf read(path);
  const Skeleton& skeleton = *clip.skeleton;
  REQUIRE(std::ssize(read.time_s) == clip.frames());
  REQUIRE(read.model.skins.size() == 1);
  const std::size_t nodes = read.model.nodes.size() - 1;  // without the mannequin's
  CHECK(read.model.skins[0].joints.size() == nodes);
  for (int i = 0; i < clip.frames(); ++i) {
    const WorldPose truth = world_pose(skeleton, clip.frame(i));
    const auto shown = read.at(static_cast<std::size_t>(i));
    std::size_t tip = skeleton.joints.size();
    for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
      CHECK((shown[j].translation() - truth.position_m[j]).norm() < kSame_m);
      const auto& end = skeleton.joints[j].end_site_m;
      if (!end) continue;
      const Eigen::Vector3d at = truth.position_m[j] + truth.rotation[j] * *end;
      CHECK((shown[tip++].translation() - at).norm() < kSame_m);
    }
    CHECK(tip == nodes);
  }
}

void check_vrma(const clip::Clip& clip) {
  const test::TempFolder folder;
  const auto path = folder.path() / "out.vrma";
  REQUIRE(write_vrm_animation(clip, path));
  const test::ReadGltf read(path);
  const auto& extension = read.model.extensions.at("VRMC_vrm_animation");
  CHECK(extension.Get("specVersion").Get<std::string>() == "1.0");
  const auto& bones = extension.Get("humanoid").Get("humanBones");
  const auto humanoid = canonical_skeleton(*clip.skeleton).value();
  REQUIRE(bones.Keys().size() == humanoid->joints.size());
  double lowest_m = 1.0;
  const Skeleton& skeleton = *clip.skeleton;
  for (const std::string& name : bones.Keys()) {
    const auto node = static_cast<std::size_t>(bones.Get(name).Get("node").Get<int>());
    CHECK(read.model.nodes.at(node).rotation.empty());  // identity in T-pose
    double height_m = 0.0;
    for (int n = static_cast<int>(node); n >= 0; n = read.parent[static_cast<std::size_t>(n)]) {
      height_m += read.model.nodes[static_cast<std::size_t>(n)].translation[1];
    }
    lowest_m = std::min(lowest_m, height_m);
  }
  CHECK(lowest_m > -1e-6);  // the T-pose stands on the ground, here on toes or their tips
  CHECK(lowest_m < 0.15);
  for (std::size_t i = 0; i < read.time_s.size(); ++i) {
    const WorldPose truth = world_pose(skeleton, clip.frame(static_cast<int>(i)));
    const auto shown = read.at(i);
    for (const std::string& name : bones.Keys()) {
      const auto node = static_cast<std::size_t>(bones.Get(name).Get("node").Get<int>());
      const int joint = skeleton.joint_of(bone_from_name(name).value());
      REQUIRE(joint >= 0);
      const auto j = static_cast<std::size_t>(joint);
      // In the world a bone is turned from its T-pose as the clip's joint is from its own.
      const Eigen::Quaterniond turned =
          truth.rotation[j] * skeleton.joints[j].T_world_joint.conjugate();
      CHECK(angle_between_rad(Eigen::Quaterniond(shown[node].rotation()), turned) < 1e-5);
      if (name == "hips") {
        CHECK((shown[node].translation() - truth.position_m[j]).norm() < kSame_m);
      }
    }
  }
}

// `bytes`: whole words.
std::string glb_of(std::string json, const std::string& bytes) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto number = [](std::size_t value) {
    const auto word = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&word), sizeof word);  // NOLINT: its bytes
  };
  const std::string body =
      number(json.size()) + "JSON" + json + number(bytes.size()) + std::string("BIN\0", 4) + bytes;
  return "glTF" + number(2) + number(12 + body.size()) + body;
}

}  // namespace

TEST_CASE("a .glb shows the joints and end sites where the clip has them") {
  check_glb(walker_clip());
}

TEST_CASE("a .glb shows a mannequin whose bones lie between the joints") {
  const test::TempFolder folder;
  const clip::Clip walk = walker_clip();
  REQUIRE(clip::write_glb(walk, folder.path() / "out.glb"));
  const test::ReadGltf read(folder.path() / "out.glb");
  REQUIRE(read.model.meshes.size() == 1);
  CHECK(read.model.nodes.back().skin == 0);
  const auto& mesh = read.model.meshes[0].primitives.at(0);
  const auto& corners = read.model.accessors.at(static_cast<std::size_t>(mesh.indices));
  CHECK(corners.count % 3 == 0);
  const auto places = read.numbers(mesh.attributes.at("POSITION"));
  const std::size_t vertices = places.size() / 3;
  CHECK(vertices == 26 * (read.model.nodes.size() - 2));  // a capsule for each node but the root
  double highest_m = 0.0, lowest_m = 9.0, widest_m = 0.0;
  for (std::size_t v = 0; v < vertices; ++v) {
    widest_m = std::max<double>(widest_m, std::abs(places[3 * v + 2]));
    highest_m = std::max<double>(highest_m, places[3 * v + 1]);
    lowest_m = std::min<double>(lowest_m, places[3 * v + 1]);
  }
  CHECK(highest_m - lowest_m > 1.4);  // a grown person
  CHECK(highest_m - lowest_m < 2.2);
  CHECK(widest_m < 0.4);
}

TEST_CASE("a joint below the root moves in a .glb if it has position channels") {
  auto skeleton = std::make_shared<Skeleton>();
  for (const char* name : {"reference", "hips"}) {
    Joint joint;
    joint.name = name;
    joint.parent = static_cast<int>(skeleton->joints.size()) - 1;
    joint.offset_m = Eigen::Vector3d(0.1, 0.2, -0.3);
    skeleton->joints.push_back(joint);
  }
  for (const std::uint16_t joint : {std::uint16_t{0}, std::uint16_t{1}}) {
    for (const bool translation : {true, false}) {
      for (const Axis axis : {Axis::kZ, Axis::kX, Axis::kY}) {
        skeleton->channels.push_back({.joint = joint, .axis = axis, .translation = translation});
      }
    }
  }
  skeleton->root_joint = 1;
  REQUIRE(skeleton->finish());
  clip::Clip clip;
  clip.skeleton = skeleton;
  clip.frame_rate_hz = 30.0;
  clip.channels = clip::ChannelMatrix::Random(5, 12);
  const test::TempFolder folder;
  REQUIRE(clip::write_glb(clip, folder.path() / "out.glb"));
  const test::ReadGltf read(folder.path() / "out.glb");
  for (int i = 0; i < clip.frames(); ++i) {
    const auto p = clip.frame(i).root_position_m;
    const Eigen::Vector3d truth = Eigen::Vector3f(p[0], p[1], p[2]).cast<double>();
    CHECK((read.at(static_cast<std::size_t>(i))[1].translation() - truth).norm() < kSame_m);
  }
}

TEST_CASE("a .glb keeps the clip's own times") {
  clip::Clip clip = walker_clip();
  for (int i = 0; i < clip.frames(); ++i) clip.time_s.push_back(7.0 + i * 0.01 + (i % 3) * 0.002);
  const test::TempFolder folder;
  REQUIRE(clip::write_glb(clip, folder.path() / "out.glb"));
  const test::ReadGltf read(folder.path() / "out.glb");
  for (int i = 0; i < clip.frames(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    CHECK(read.time_s[at] == Approx(clip.time_s[at] - 7.0).margin(1e-6));
  }
  check_glb(clip);
  const auto back = clip::read_clip(folder.path() / "out.glb");
  if (!back) FAIL(back.error().text());
  CHECK(back->time_s.size() == clip.time_s.size());
  CHECK(back->metres_per_unit == 0.01);  // of a BVH, where programs take a unit for a centimetre
  clip.frame_rate_hz = back->frame_rate_hz;
  test::check_same_motion(clip, *back);  // frame by frame
}

TEST_CASE("frames that came at one moment have increasing times in glTF") {
  clip::Clip clip = walker_clip();
  for (int i = 0; i < clip.frames(); ++i) clip.time_s.push_back(0.5 * (i / 2));
  const auto time_s = clip::gltf_times(clip).value();
  CHECK(std::ranges::adjacent_find(time_s, std::ranges::greater_equal()) == time_s.end());
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    CHECK(time_s[i] == Approx(clip.time_s[i]).margin(1e-6));
  }
}

TEST_CASE("CMU's walk as .glb and .vrma") {
  const auto amc = test::shared("data/cmu/07_01.amc");
  if (!amc) SKIP_WITHOUT_SHARED();
  clip::Clip clip = clip::read_clip(*amc).value();
  clip.channels = clip.channels.topRows(20).eval();
  check_glb(clip);
  check_vrma(clip);
}

TEST_CASE("a .vrma turns the bones of the humanoid as the clip does and moves its hips") {
  check_vrma(walker_clip());
}

TEST_CASE("neighbouring rotations of a glTF track have the nearer of two signs") {
  clip::GltfNode node;
  const Eigen::Quaterniond q(0.6, 0.8, 0.0, 0.0);
  clip::add_rotation(node, q);
  clip::add_rotation(node, Eigen::Quaterniond(-q.coeffs()));
  CHECK(node.rotation_xyzw[4] == node.rotation_xyzw[0]);
  CHECK(node.rotation_xyzw[7] == node.rotation_xyzw[3]);
}

TEST_CASE("the same clip gives the same bytes, whatever the names of its joints hold") {
  clip::Clip clip = walker_clip();
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  skeleton->joints[1].name = "\xff\"\n\\";
  clip.skeleton = skeleton;
  const test::TempFolder folder;
  REQUIRE(clip::write_glb(clip, folder.path() / "one.glb"));
  const std::string one = test::file_text(folder.path() / "one.glb");
  REQUIRE(clip::write_glb(clip, folder.path() / "one.glb"));
  CHECK(test::file_text(folder.path() / "one.glb") == one);
  CHECK(test::ReadGltf(folder.path() / "one.glb").model.nodes[1].name == "\\xff\"\\n\\");
}

TEST_CASE("clips that glTF cannot hold are refused with a reason") {
  const test::TempFolder folder;
  const auto path = folder.path() / "out.glb";
  const auto error = [&](const clip::Clip& clip) {
    const auto written = clip::write_glb(clip, path);
    REQUIRE_FALSE(written);
    CHECK_FALSE(std::filesystem::exists(path));
    return written.error().message;
  };
  clip::Clip clip = walker_clip();
  clip::Clip changed = clip;
  changed.channels.resize(0, clip.channels.cols());
  CHECK(test::has(error(changed), "no frames"));
  changed = clip;
  for (int i = 0; i < clip.frames(); ++i) changed.time_s.push_back(i * 0.01);
  changed.time_s[3] = changed.time_s[1];
  CHECK(test::has(error(changed), "frame 4 is before"));
  changed.time_s[3] = std::numeric_limits<double>::quiet_NaN();
  CHECK(test::has(error(changed), "frame 4 is before"));
  changed = clip;
  changed.channels(2, 5) = std::numeric_limits<double>::quiet_NaN();
  CHECK(test::has(error(changed), "has no value"));
}

TEST_CASE("a .vrma needs the bones that VRM requires, and names those that are missing") {
  const test::TempFolder folder;
  clip::Clip clip = walker_clip();
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  for (Joint& joint : skeleton->joints) {
    if (joint.bone == Bone::kLeftHand || joint.bone == Bone::kSpine) joint.bone.reset();
  }
  clip.skeleton = skeleton;
  const auto written = write_vrm_animation(clip, folder.path() / "out.vrma");
  REQUIRE_FALSE(written);
  CHECK(test::has(written.error().message, "spine, leftHand;"));
  CHECK_FALSE(std::filesystem::exists(folder.path() / "out.vrma"));
}

TEST_CASE("a figure with a neck alone above its hips gets VRM's spine in its .vrma") {
  clip::add_format(vrm_animation_format());
  const test::TempFolder folder;
  clip::Clip clip = walker_clip();
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  for (Joint& joint : skeleton->joints) {
    if (joint.bone >= Bone::kSpine && joint.bone <= Bone::kUpperChest) joint.bone.reset();
  }
  clip.skeleton = skeleton;
  const auto path = folder.path() / "out.vrma";
  REQUIRE(write_vrm_animation(clip, path));
  const auto back = clip::read_clip(path);
  if (!back) FAIL(back.error().text());
  const Skeleton& figure = *back->skeleton;
  REQUIRE(figure.joint_of(Bone::kSpine) >= 0);
  CHECK(figure.joints[figure.joint_of(Bone::kNeck)].parent == figure.joint_of(Bone::kSpine));
  CHECK(figure.joints[figure.joint_of(Bone::kLeftUpperLeg)].parent == 0);
  const WorldPose truth = world_pose(*clip.skeleton, clip.frame(9));
  const WorldPose got = world_pose(figure, back->frame(9));
  const auto head = static_cast<std::size_t>(figure.joint_of(Bone::kHead));
  const auto from = static_cast<std::size_t>(skeleton->joint_of(Bone::kHead));
  const Eigen::Quaterniond was =
      truth.rotation[from] * skeleton->joints[from].T_world_joint.conjugate();
  const Eigen::Quaterniond is = got.rotation[head] * figure.joints[head].T_world_joint.conjugate();
  CHECK(angle_between_rad(is, was) < 2e-4);
}

namespace {

// A figure of VRM's required bones. `backwards`: it looks along -Z, as VRM 0 does; `twisted`: its
// nodes have rotations at rest, below an armature that is turned and scaled.
struct AvatarFile {
  struct Bone_ {
    const char* name;
    int parent;
    Eigen::Vector3d at_m;
  };
  static const std::vector<Bone_>& bones() {
    static const std::vector<Bone_> all{{"hips", -1, {0, 0.9, 0}},
                                        {"spine", 0, {0, 1.0, -0.02}},
                                        {"head", 1, {0, 1.45, 0}},
                                        {"leftUpperArm", 1, {0.15, 1.3, 0}},
                                        {"leftLowerArm", 3, {0.4, 1.28, 0}},
                                        {"leftHand", 4, {0.63, 1.27, 0}},
                                        {"rightUpperArm", 1, {-0.15, 1.3, 0}},
                                        {"rightLowerArm", 6, {-0.4, 1.28, 0}},
                                        {"rightHand", 7, {-0.63, 1.27, 0}},
                                        {"leftUpperLeg", 0, {0.09, 0.85, 0}},
                                        {"leftLowerLeg", 9, {0.09, 0.45, 0.01}},
                                        {"leftFoot", 10, {0.09, 0.08, -0.02}},
                                        {"rightUpperLeg", 0, {-0.09, 0.85, 0}},
                                        {"rightLowerLeg", 12, {-0.09, 0.45, 0.01}},
                                        {"rightFoot", 13, {-0.09, 0.08, -0.02}}};
    return all;
  }

  // With arms that hang so far a bone.
  static std::string text(bool backwards, bool twisted, double hang_m = 0.0) {
    const auto place = [hang_m](const Bone_& bone) {
      const std::string_view name = bone.name;
      const double bones = name.ends_with("LowerArm") ? 1.0 : name.ends_with("Hand") ? 2.0 : 0.0;
      return Eigen::Vector3d(bone.at_m - bones * hang_m * Eigen::Vector3d::UnitY());
    };
    const auto numbers = [](const auto& values) {
      std::string list;
      for (const double x : values) list += (list.empty() ? "" : ",") + std::to_string(x);
      return "[" + list + "]";
    };
    const double scale = twisted ? 0.01 : 1.0;
    const Eigen::Quaterniond above(twisted ? axis_rotation(Axis::kX, -1.2)
                                           : Eigen::Quaterniond::Identity());
    std::string nodes =
        "{\"name\":\"Armature\",\"children\":[1],\"rotation\":" + numbers(above.coeffs()) +
        ",\"scale\":" + numbers(std::vector<double>(3, scale)) + "}";
    std::string named;
    std::vector<Eigen::Quaterniond> world;
    for (std::size_t b = 0; b < bones().size(); ++b) {
      const Bone_& bone = bones()[b];
      world.push_back(twisted ? axis_rotation(Axis::kZ, 0.3 * double(b)) *
                                    axis_rotation(Axis::kY, 1.0 + double(b))
                              : Eigen::Quaterniond::Identity());
      const auto turned = [&](Eigen::Vector3d v) {
        return backwards ? Eigen::Vector3d(-v.x(), v.y(), -v.z()) : v;
      };
      const bool root = bone.parent < 0;
      const Eigen::Quaterniond parent = root ? above : world[std::size_t(bone.parent)];
      Eigen::Vector3d from = turned(place(bone));
      if (!root) from -= turned(place(bones()[std::size_t(bone.parent)]));
      std::string children;
      for (std::size_t c = 0; c < bones().size(); ++c) {
        if (bones()[c].parent != int(b)) continue;
        children += (children.empty() ? "" : ",") + std::to_string(c + 1);
      }
      nodes += ",{\"name\":\"b" + std::to_string(b) +
               "\",\"translation\":" + numbers(Eigen::Vector3d(parent.conjugate() * from / scale)) +
               ",\"rotation\":" + numbers((parent.conjugate() * world[b]).coeffs()) +
               (children.empty() ? "" : ",\"children\":[" + children + "]") + "}";
      const std::string node = "\"node\":" + std::to_string(b + 1);
      named += (named.empty() ? "" : ",") +
               (backwards ? "{\"bone\":\"" + std::string(bone.name) + "\"," + node + "}"
                          : "\"" + std::string(bone.name) + "\":{" + node + "}");
    }
    const std::string humanoid =
        backwards ? "\"VRM\":{\"humanoid\":{\"humanBones\":[" + named + "]}}"
                  : "\"VRMC_vrm\":{\"humanoid\":{\"humanBones\":{" + named + "}}}";
    return "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[" +
           nodes + "],\"extensions\":{" + humanoid + "}}";
  }
};

}  // namespace

TEST_CASE("a .glb is read back as the clip that was written") {
  const test::TempFolder folder;
  const auto path = folder.path() / "walk.glb";
  const clip::Clip walk = walker_clip();
  REQUIRE(clip::write_glb(walk, path));
  const auto back = clip::read_clip(path);
  if (!back) FAIL(back.error().text());
  test::check_same_motion(walk, *back);
  CHECK(back->skeleton->joints.size() == walk.skeleton->joints.size());
  for (std::size_t j = 0; j < walk.skeleton->joints.size(); ++j) {
    CHECK(back->skeleton->joints[j].bone == walk.skeleton->joints[j].bone);
    CHECK(back->skeleton->joints[j].end_site_m.has_value() ==
          walk.skeleton->joints[j].end_site_m.has_value());
  }
}

TEST_CASE("a .vrma is read back as the same turns of the same bones") {
  clip::add_format(vrm_animation_format());
  const test::TempFolder folder;
  const auto path = folder.path() / "walk.vrma";
  const clip::Clip walk = walker_clip();
  REQUIRE(write_vrm_animation(walk, path));
  const auto back = clip::read_clip(path);
  if (!back) FAIL(back.error().text());
  REQUIRE(back->frames() == walk.frames());
  for (int i = 0; i < walk.frames(); ++i) {
    const WorldPose truth = world_pose(*walk.skeleton, walk.frame(i));
    const WorldPose got = world_pose(*back->skeleton, back->frame(i));
    for (std::size_t k = 0; k < back->skeleton->joints.size(); ++k) {
      const Joint& joint = back->skeleton->joints[k];
      REQUIRE(joint.bone);
      const auto j = static_cast<std::size_t>(walk.skeleton->joint_of(*joint.bone));
      const Eigen::Quaterniond is = got.rotation[k] * joint.T_world_joint.conjugate();
      const Eigen::Quaterniond was =
          truth.rotation[j] * walk.skeleton->joints[j].T_world_joint.conjugate();
      CHECK(angle_between_rad(is, was) < 2e-4);
    }
  }
}

TEST_CASE("an avatar of VRM 0 or 1 faces forward, rests in T and has the lengths of its bones") {
  const bool backwards = GENERATE(false, true);
  const bool twisted = GENERATE(false, true);
  INFO((backwards ? "VRM 0" : "VRM 1") << (twisted ? ", twisted" : ""));
  const auto avatar =
      clip::parse_clip({.name = "me.vrm", .bytes = AvatarFile::text(backwards, twisted)});
  if (!avatar) FAIL(avatar.error().text());
  CHECK(avatar->frames() == 1);
  const Skeleton& skeleton = *avatar->skeleton;
  REQUIRE(skeleton.joints.size() == AvatarFile::bones().size());
  const WorldPose rest = world_pose(skeleton, avatar->frame(0));
  for (const AvatarFile::Bone_& bone : AvatarFile::bones()) {
    INFO(bone.name);
    const int joint = skeleton.joint_of(bone_from_name(bone.name).value());
    REQUIRE(joint >= 0);
    const auto j = static_cast<std::size_t>(joint);
    CHECK((rest.position_m[j] - bone.at_m).norm() < 1e-5);
    CHECK(angle_between_rad(skeleton.joints[j].T_world_joint, Eigen::Quaterniond::Identity()) <
          1e-6);
  }
}

TEST_CASE("an avatar whose arms hang at rest rests in T but for them, a VRM animation whatever") {
  const bool backwards = GENERATE(false, true);
  const std::string text = AvatarFile::text(backwards, true, 0.25);
  const auto avatar = clip::parse_clip({.name = "me.vrm", .bytes = text});
  if (!avatar) FAIL(avatar.error().text());
  const auto direction_in_t = [](const Skeleton& skeleton, Bone from, Bone to) {
    const Joint& joint = skeleton.joints[std::size_t(skeleton.joint_of(from))];
    const Joint& below = skeleton.joints[std::size_t(skeleton.joint_of(to))];
    return Eigen::Vector3d((joint.T_world_joint * below.offset_m).normalized());
  };
  const Skeleton& skeleton = *avatar->skeleton;
  using enum Bone;
  CHECK(direction_in_t(skeleton, kLeftUpperArm, kLeftLowerArm).x() > 0.9999);
  CHECK(direction_in_t(skeleton, kLeftLowerArm, kLeftHand).x() > 0.9999);
  CHECK(direction_in_t(skeleton, kRightUpperArm, kRightLowerArm).x() < -0.9999);
  for (const Bone bone : {kHips, kHead, kLeftUpperLeg, kLeftFoot}) {
    const Joint& joint = skeleton.joints[std::size_t(skeleton.joint_of(bone))];
    CHECK(angle_between_rad(joint.T_world_joint, Eigen::Quaterniond::Identity()) < 1e-6);
  }
  if (backwards) return;
  std::string animation = text;
  animation.replace(animation.find("VRMC_vrm"), 8, "VRMC_vrm_animation");
  const auto moving = clip::parse_clip({.name = "me.gltf", .bytes = animation});
  if (!moving) FAIL(moving.error().text());
  for (const Joint& joint : moving->skeleton->joints) {
    CHECK(angle_between_rad(joint.T_world_joint, Eigen::Quaterniond::Identity()) < 1e-6);
  }
}

namespace {

// A walk as a .glb that another program could have written.
class OtherGlb {
 public:
  OtherGlb() : path_(folder_.path() / "walk.glb") {
    REQUIRE(clip::write_glb(walk, path_));
    model = test::ReadGltf(path_).model;
  }

  Result<clip::Clip> read() {
    REQUIRE(
        tinygltf::TinyGLTF().WriteGltfSceneToFile(&model, path_.string(), true, true, false, true));
    return clip::read_clip(path_);
  }
  void check_same(double most_rad = 1e-3) {
    const auto back = read();
    if (!back) FAIL(back.error().text());
    test::check_same_motion(walk, *back);
    for (const Joint& joint : walk.skeleton->joints) {
      INFO(joint.name);
      const Joint& got =
          back->skeleton->joints[static_cast<std::size_t>(back->skeleton->joint_index(joint.name))];
      CHECK(got.bone == joint.bone);
      CHECK(angle_between_rad(got.T_world_joint, joint.T_world_joint) < most_rad);
    }
  }
  tinygltf::Accessor& keys(std::size_t channel) {
    tinygltf::Animation& animation = model.animations.back();
    const auto sampler = static_cast<std::size_t>(animation.channels[channel].sampler);
    return model.accessors[static_cast<std::size_t>(animation.samplers[sampler].output)];
  }
  std::vector<double> key(std::size_t channel, std::size_t at) {
    const tinygltf::Accessor& accessor = keys(channel);
    const auto& view = model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
    std::vector<float> values(accessor.type == TINYGLTF_TYPE_VEC4 ? 4 : 3);
    const std::size_t bytes = values.size() * sizeof(float);
    std::memcpy(values.data(), model.buffers[0].data.data() + view.byteOffset + at * bytes, bytes);
    return {values.begin(), values.end()};
  }

  clip::Clip walk = walker_clip();
  tinygltf::Model model;

 private:
  test::TempFolder folder_;
  std::filesystem::path path_;
};

}  // namespace

TEST_CASE("nodes that stand in a pose: the figure rests where its skin was bound") {
  OtherGlb glb;
  const auto& channels = glb.model.animations[0].channels;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    auto& node = glb.model.nodes[static_cast<std::size_t>(channels[c].target_node)];
    if (channels[c].target_path == "rotation") node.rotation = glb.key(c, 20);
    if (channels[c].target_path == "translation") node.translation = glb.key(c, 20);
  }
  const auto back = glb.read();
  if (!back) FAIL(back.error().text());
  for (const int i : {0, 31}) {
    const WorldPose truth = world_pose(*glb.walk.skeleton, glb.walk.frame(i));
    const WorldPose got = world_pose(*back->skeleton, back->frame(i));
    for (std::size_t j = 0; j < glb.walk.skeleton->joints.size(); ++j) {
      const Joint& joint = glb.walk.skeleton->joints[j];
      INFO(joint.name);
      const auto k = static_cast<std::size_t>(back->skeleton->joint_index(joint.name));
      CHECK((got.position_m[k] - truth.position_m[j]).norm() < 1e-4);
      const auto& T = back->skeleton->joints[k].T_world_joint;
      CHECK(angle_between_rad(got.rotation[k] * T.conjugate(),
                              truth.rotation[j] * joint.T_world_joint.conjugate()) < 1e-3);
    }
  }
}

// One who sits all the time on the skeleton of one who stands.
TEST_CASE("hips below a root that stay elsewhere than at rest are where the keys have them") {
  OtherGlb glb;
  const auto& channels = glb.model.animations[0].channels;
  std::size_t c = 0;
  while (channels[c].target_path != "translation") ++c;
  const int hips = channels[c].target_node;
  const std::vector<double> place = glb.key(c, 0);
  const auto& view = glb.model.bufferViews[static_cast<std::size_t>(glb.keys(c).bufferView)];
  unsigned char* first = glb.model.buffers[0].data.data() + view.byteOffset;
  const std::size_t bytes = 3 * sizeof(float);
  for (std::size_t i = 1; i < glb.keys(c).count; ++i) std::memcpy(first + i * bytes, first, bytes);
  tinygltf::Node root;
  root.name = "root";
  root.children = {hips};
  glb.model.nodes[static_cast<std::size_t>(hips)].translation = {0.0, place[1] + 0.4, 0.0};
  glb.model.skins[0].joints.push_back(static_cast<int>(glb.model.nodes.size()));
  glb.model.skins[0].inverseBindMatrices = -1;
  std::ranges::replace(glb.model.scenes[0].nodes, hips, static_cast<int>(glb.model.nodes.size()));
  glb.model.nodes.push_back(root);
  const auto back = glb.read();
  if (!back) FAIL(back.error().text());
  const auto k = static_cast<std::size_t>(back->skeleton->joint_of(Bone::kHips));
  REQUIRE(k == 1);
  CHECK(world_pose(*back->skeleton, back->frame(5)).position_m[k].y() == Approx(place[1]));
}

TEST_CASE("sparse keys are read") {
  OtherGlb glb;
  tinygltf::Accessor& keys = glb.keys(3);
  std::vector<std::uint16_t> places(keys.count);
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<std::uint16_t>(i);
  keys.sparse = {.count = static_cast<int>(keys.count),
                 .isSparse = true,
                 .indices = {.byteOffset = 0,
                             .bufferView = static_cast<int>(glb.model.bufferViews.size()),
                             .componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
                 .values = {.bufferView = keys.bufferView, .byteOffset = 0}};
  keys.bufferView = -1;
  auto& data = glb.model.buffers[0].data;
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = data.size();
  view.byteLength = places.size() * sizeof(places[0]);
  const auto bytes = std::as_bytes(std::span(places));
  for (const std::byte byte : bytes) data.push_back(static_cast<unsigned char>(byte));
  glb.model.bufferViews.push_back(view);
  glb.check_same();
}

TEST_CASE("the animation that moves the figure is read, and the second of two channels is not") {
  OtherGlb glb;
  tinygltf::Animation still = glb.model.animations[0];  // of a node that is no joint
  still.channels.resize(1);
  still.channels[0].target_node = static_cast<int>(glb.model.nodes.size()) - 1;
  glb.model.animations.insert(glb.model.animations.begin(), still);
  auto& channels = glb.model.animations[1].channels;
  channels.push_back(channels.back());
  channels.back().sampler = channels[2].sampler;
  glb.check_same();
}

TEST_CASE("joints that no skin has are joints where an animation turns them") {
  OtherGlb glb;
  const auto lacks = [&](int node) {
    const std::string& name = glb.model.nodes[static_cast<std::size_t>(node)].name;
    return test::has(name, "Foot") || test::has(name, "Toe") || test::has(name, "Head");
  };
  std::erase_if(glb.model.skins[0].joints, lacks);
  glb.model.skins[0].inverseBindMatrices = -1;
  glb.check_same();
}

TEST_CASE("nodes of one name are told apart by their parents, as joints of a BVH") {
  OtherGlb glb;
  std::vector<std::string> expected;
  for (tinygltf::Node& node : glb.model.nodes) {
    if (!test::has(node.name, "Foot")) continue;
    const auto number = static_cast<int>(&node - glb.model.nodes.data());
    const auto parent = std::ranges::find_if(glb.model.nodes, [&](const tinygltf::Node& above) {
      return std::ranges::find(above.children, number) != above.children.end();
    });
    node.name = "Foot";
    expected.push_back(expected.empty() ? node.name : parent->name + "/" + node.name);
  }
  REQUIRE(expected.size() == 2);
  const auto back = glb.read();
  if (!back) FAIL(back.error().text());
  for (const std::string& name : expected) CHECK(back->skeleton->joint_index(name) >= 0);
  CHECK(std::ranges::any_of(back->warnings, [&](const std::string& warning) {
    return test::has(warning, "parent, too, as '" + expected[1] + "'");
  }));
  CHECK(back->skeleton->joint_of(Bone::kLeftFoot) >= 0);
  CHECK(back->skeleton->joint_of(Bone::kRightFoot) >= 0);
}

TEST_CASE("a glTF of another unit that stands along +z is brought into metres and +y up") {
  OtherGlb glb;
  const bool small = GENERATE(false, true);
  tinygltf::Node above;
  above.name = "root";
  above.children = glb.model.scenes[0].nodes;
  above.scale.assign(3, small ? 0.01 : 100.0);
  const double half = std::sqrt(0.5);
  above.rotation = {half, 0.0, 0.0, half};
  glb.model.scenes[0].nodes = {static_cast<int>(glb.model.nodes.size())};
  glb.model.nodes.push_back(above);
  glb.check_same(1e-3);
  const auto back = glb.read();
  REQUIRE(back->warnings.size() >= 2);
  CHECK(test::has(back->warnings[back->warnings.size() - 2],
                  small ? "metres that the file calls centimetres" : "taken as centimetres"));
  CHECK(test::has(back->warnings.back(), "taken as +z up"));
}

TEST_CASE("what is no glTF, or a damaged one, is refused with a reason") {
  const auto refused = [](const std::string& bytes) {
    const auto clip = clip::parse_clip({.name = "x.gltf", .bytes = bytes});
    INFO(bytes.substr(0, 80));
    REQUIRE_FALSE(clip);
    return clip.error().text();
  };
  CHECK(test::has(refused("glTF and nothing more"), "no glTF that can be read"));
  CHECK(test::has(refused("{"), "no glTF that can be read"));
  CHECK(test::has(refused("{\"nodes\":" + std::string(1'000'000, '[')), "nested too deep"));
  const std::string asset = "{\"asset\":{\"version\":\"2.0\"}";
  CHECK(test::has(refused(asset + "}"), "no nodes"));
  CHECK(test::has(refused(asset + ",\"nodes\":[{\"children\":[1]},{\"children\":[0]}]}"),
                  "in a circle"));
  CHECK(test::has(refused(asset + ",\"buffers\":[{\"uri\":\"/etc/passwd\",\"byteLength\":4}]"
                                  ",\"nodes\":[{}]}"),
                  "no glTF that can be read"));
}

TEST_CASE("whole numbers of a glTF may be written with a point or an exponent") {
  const bool backwards = GENERATE(false, true);
  const std::string plain = AvatarFile::text(backwards, true);
  std::string pointed;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    pointed += plain[i];
    const bool ends =
        plain[i] >= '0' && plain[i] <= '9' && std::string(",]}").contains(plain[i + 1]);
    if (ends && plain.find_last_of(".\"", i) == plain.find_last_of('"', i)) {
      pointed += i % 2 == 0 ? ".0" : "e0";
    }
  }
  const auto want = clip::parse_clip({.name = "me.vrm", .bytes = plain});
  for (const std::string& bytes : {pointed, glb_of(pointed, std::string(4, 0))}) {
    const auto got = clip::parse_clip({.name = "me.vrm", .bytes = bytes});
    if (!want || !got) FAIL((want ? got : want).error().text());
    CHECK(got->skeleton->id == want->skeleton->id);
  }
  const auto kept = clip::parse_clip(
      {.name = "x.glb",
       .bytes = glb_of(R"({"asset":{"version":"2.0"},"nodes":[{"translation":[1e1,-0.0,0.5]},)"
                       R"({"children":[0.0],"scale":[1e0,1.0,10e-1]}],"accessors":[)"
                       R"({"count":1e9,"componentType":5126.0,"type":"SCALAR"}]})",
                       std::string(4, 0))});
  if (!kept) FAIL(kept.error().text());
  CHECK(kept->skeleton->joints.size() == 2);
}

TEST_CASE("what a glTF or BVH is, its content says before its name") {
  const test::TempFolder folder;
  const clip::Clip walk = walker_clip();
  REQUIRE(clip::write_glb(walk, folder.path() / "walk.glb"));
  REQUIRE(clip::write_clip(walk, folder.path() / "walk.bvh"));
  std::filesystem::copy_file(folder.path() / "walk.glb", folder.path() / "glb.bvh");
  std::filesystem::copy_file(folder.path() / "walk.bvh", folder.path() / "bvh.vrm");
  folder.write("gltf.bvh", AvatarFile::text(false, false));
  for (const char* name : {"glb.bvh", "bvh.vrm", "gltf.bvh"}) {
    const auto clip = clip::read_clip(folder.path() / name);
    INFO(name);
    if (!clip) FAIL(clip.error().text());
    CHECK(clip->skeleton->joint_of(Bone::kHips) >= 0);
  }
}

TEST_CASE("a glTF that asks for more than its size is refused, or read once") {
  const std::string asset = "{\"asset\":{\"version\":\"2.0\"}";
  const auto why = [](const std::string& bytes) {
    const auto clip = clip::parse_clip({.name = "x.gltf", .bytes = bytes});
    return clip ? std::string() : clip.error().text();
  };
  const auto repeated = [](std::string_view what, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += what;
    return all;
  };
  const std::string node = asset + ",\"nodes\":[{}],\"extras\":";
  const std::string bones = asset + ",\"nodes\":[{}],\"extensions\":{\"VRM\":{\"humanoid\":";
  CHECK(why(bones + repeated("[", 90) + repeated("]", 90) + "}}}").empty());
  CHECK(test::has(why(bones + repeated("[", 500'000) + repeated("]", 500'000) + "}}}"), "nested"));
  CHECK(test::has(why(bones + "[" + repeated("0,", 500'000) + "0]}}}"), "too much"));
  // What posed has no use for costs nothing, wherever it is.
  CHECK(why(node + repeated("[", 500'000) + repeated("]", 500'000) + "}").empty());
  CHECK(why(node + "0,\"materials\":[" + repeated("{},", 2'000'000) + "{}]}").empty());
  CHECK(
      why(asset + ",\"nodes\":[{\"extensions\":[" + repeated("{},", 2'000'000) + "{}]}]}").empty());
  CHECK(why(asset + ",\"nodes\":[{}],\"extensions\":{\"VRM\":{\"meta\":[" +
            repeated("{},", 2'000'000) + "{}]}}}")
            .empty());
  CHECK(why(node + "\"" + repeated("[{,", 1'000'000) + "\"}").empty());  // as a text
  CHECK(why(asset + ",\"nodes\":[{}],\"extensions\":{\"VRM\":{\"humanoid\":7},"
                    "\"VRMC_vrm\":{\"humanoid\":{\"humanBones\":{\"head\":7}}}}}")
            .empty());

  std::string doubled = asset + ",\"nodes\":[";
  constexpr int kNodes = 60;
  for (int i = 1; i < kNodes; ++i) {
    const std::string child = std::to_string(i);
    doubled += "{\"children\":[" + child + "," + child + "]},";
  }
  const auto chain = clip::parse_clip({.name = "x.gltf", .bytes = doubled + "{}]}"});
  REQUIRE(chain);
  CHECK(chain->skeleton->joints.size() == kNodes);
}

TEST_CASE("a .glb whose binary part is copied for each of many buffers is refused") {
  std::string json = R"({"asset":{"version":"2.0"},"nodes":[{}],"buffers":[{"byteLength":100000})";
  for (int i = 0; i < 300; ++i) json += R"(,{"byteLength":100000})";
  const auto clip =
      clip::parse_clip({.name = "x.glb", .bytes = glb_of(json + "]}", std::string(100'000, '\0'))});
  REQUIRE_FALSE(clip);
  CHECK(test::has(clip.error().text(), "several buffers"));
}

TEST_CASE("the tracks of a glTF take no more memory and time than its bytes are worth") {
  // A hundred keys of a second each: zeros, but for the times.
  constexpr int kKeys = 100;
  std::string bytes(kKeys * 20, '\0');
  for (int i = 0; i < kKeys; ++i) {
    const auto time_s = static_cast<float>(i);
    std::memcpy(bytes.data() + 4 * i, &time_s, sizeof time_s);
  }
  const auto glb = [&](int accessors, int channels) {
    std::string json = R"({"asset":{"version":"2.0"},"nodes":[{}],"buffers":[{"byteLength":2000}],)"
                       R"("bufferViews":[{"buffer":0,"byteLength":400},)"
                       R"({"buffer":0,"byteOffset":400,"byteLength":1600}],"accessors":[)"
                       R"({"bufferView":0,"componentType":5126,"count":100,"type":"SCALAR"})";
    for (int i = 0; i < accessors; ++i) {
      json += R"(,{"bufferView":1,"componentType":5126,"count":100,"type":"VEC4"})";
    }
    json += R"(],"animations":[{"samplers":[)";
    for (int i = 1; i <= accessors; ++i) {
      json += (i == 1 ? "" : ",") + (R"({"input":0,"output":)" + std::to_string(i) + "}");
    }
    json += R"(],"channels":[)";
    for (int i = 0; i < channels; ++i) {
      json += (i == 0 ? R"({"sampler":)" : R"(,{"sampler":)") + std::to_string(i % accessors) +
              R"(,"target":{"node":0,"path":"rotation"}})";
    }
    return clip::parse_clip({.name = "x.glb", .bytes = glb_of(json + "]}]}", bytes)});
  };
  const auto fair = glb(4, 100);
  REQUIRE(fair);
  CHECK(fair->frames() == 60 * (kKeys - 1) + 1);  // keys a second apart: the motion is between
}

}  // namespace posed::motion
