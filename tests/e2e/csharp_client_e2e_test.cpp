// The C# client for Unity with the real daemon: compiled by Debian's mono-mcs with stubs of Unity's
// types, its avatar takes the pose of the clip that plays.
#include <catch2/catch.hpp>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <sstream>

#include "models/motion/kinematics.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

struct AvatarPose {
  std::map<std::string, Eigen::Quaterniond> turn;  // by VRM bone, in Unity's axes
  Eigen::Vector3d hips = Eigen::Vector3d::Zero();
  std::string timecode;
};

AvatarPose parse_avatar(const std::string& text) {
  AvatarPose pose;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    std::array<double, 4> value{};
    words >> name;
    if (name == "timecode") {
      words >> pose.timecode;
      continue;
    }
    words >> value[0] >> value[1] >> value[2] >> value[3];
    if (name == "place") {
      pose.hips = {value[0], value[1], value[2]};
    } else {
      pose.turn[name] = Eigen::Quaterniond(value[3], value[0], value[1], value[2]);
    }
  }
  return pose;
}

// How far the avatar is from the clip's frame [rad]. Unity's X axis points the other way.
double off_rad(const AvatarPose& avatar, const clip::Clip& clip, int index) {
  const Skeleton& skeleton = *clip.skeleton;
  const motion::WorldPose pose = motion::world_pose(skeleton, clip.frame(index));
  double most_rad = 0.0;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    if (!joint.bone) continue;
    const Eigen::Quaterniond turn = pose.rotation[j] * joint.T_world_joint.conjugate();
    const Eigen::Quaterniond unity(turn.w(), turn.x(), -turn.y(), -turn.z());
    most_rad = std::max(most_rad,
                        unity.angularDistance(avatar.turn.at(std::string(bone_name(*joint.bone)))));
  }
  return most_rad;
}

// What the client's test program prints about a stream. Nothing without the tools to compile it.
std::optional<std::string> printed_by_watch(const Stage& stage, const std::string& endpoint,
                                            const std::string& stream) {
  if (std::system("command -v mcs mono >/dev/null") != 0) {
    WARN("SKIPPED without mono-mcs and mono-runtime");
    return std::nullopt;
  }
  const std::string client = (source_dir() / "proto/clients/csharp").string();
  const std::string program = stage.path("watch.exe");
  const std::string port = endpoint.substr(endpoint.rfind(':') + 1);
  const std::string command = "mcs -langversion:6 -warnaserror -out:'" + program + "' '" + client +
                              "'/*.cs '" + client + "'/test/*.cs && timeout 60 mono '" + program +
                              "' 127.0.0.1 " + port + " " + stream + " 2>&1";
  const std::unique_ptr<FILE, int (*)(FILE*)> output(popen(command.c_str(), "r"), pclose);
  REQUIRE(output);
  std::string said;
  for (char line[512]; std::fgets(line, sizeof line, output.get()) != nullptr;) said += line;
  return said;
}

// Checks that the avatar stands as in one of the clip's frames, its hips where the clip's are times
// `scale`.
void check_avatar(const std::string& said, const clip::Clip& clip, double scale) {
  INFO(said);
  const AvatarPose avatar = parse_avatar(said);
  REQUIRE(avatar.turn.contains("hips"));
  // The toy's steps repeat, so that the joints alone do not tell which frame it is.
  double nearest_rad = 1.0, nearest_m = 1.0;
  for (int i = 0; i < clip.frames(); ++i) {
    const Vec3f root_m = clip.frame(i).root_position_m;
    const Eigen::Vector3d expected_m(-root_m[0], root_m[1], root_m[2]);
    const double now_m = (avatar.hips - scale * expected_m).norm();
    const double now_rad = off_rad(avatar, clip, i);
    if (now_rad + now_m > nearest_rad + nearest_m) continue;
    nearest_rad = now_rad;
    nearest_m = now_m;
  }
  CHECK(nearest_rad < 1e-5);
  CHECK(nearest_m < 1e-5);
  CHECK(avatar.timecode.empty());
}

}  // namespace

TEST_CASE("the C# client moves a Unity avatar as the clip that plays") {
  Served served;
  served.start();
  const auto said = printed_by_watch(served, served.publish, "walker-raw");
  if (!said) return;
  // The toy has no feet, so the size of its legs is not known.
  check_avatar(*said, clip::read_clip(served.folder.path() / "walk.bvh").value(), 1.0);
}

TEST_CASE("the C# client scales the way of an avatar by the bones of the leg") {
  Stage stage;
  const auto walk = motion::make_walker({.seconds = 1.0, .rate_hz = 60.0}).value();
  REQUIRE(clip::write_bvh(walk, stage.folder.path() / "walk.bvh"));
  stage.folder.write("posed.toml", std::string(Stage::kEndpoints) + Stage::kWalker);
  stage.launch("run");
  const auto said = printed_by_watch(stage, stage.publish, "walker");
  if (!said) return;
  const clip::Clip clip = clip::read_clip(stage.folder.path() / "walk.bvh").value();
  const Skeleton& skeleton = *clip.skeleton;
  double leg_m = 0.0;
  for (int joint = skeleton.joint_of(Bone::kLeftFoot); joint != skeleton.joint_of(Bone::kHips);) {
    REQUIRE(joint >= 0);
    const Joint& bone = skeleton.joints[static_cast<std::size_t>(joint)];
    leg_m += bone.offset_m.norm();
    joint = bone.parent;
  }
  CHECK(leg_m > 0.5);
  check_avatar(*said, clip, 0.9 / leg_m);  // Watch.cs: the avatar's leg
}

TEST_CASE("the C# client reads the timecode") {
  const Stage stage;
  Process emulator(
      {"emulate", "posed", "--set", "stream=walker", "--publish", "tcp://127.0.0.1:*"});
  const auto ready = emulator.line();
  REQUIRE(ready);
  const auto said = printed_by_watch(stage, nlohmann::json::parse(*ready).at("port"), "walker");
  if (!said) return;
  INFO(*said);
  CHECK(parse_avatar(*said).timecode.starts_with("01:00:"));
}

}  // namespace posed::test
