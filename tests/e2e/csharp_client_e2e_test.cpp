// The C# client for Unity with the real daemon: compiled by Debian's mono-mcs with stubs of Unity's
// types, its avatar takes the pose of the clip that plays.
#include <catch2/catch.hpp>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>

#include "models/motion/kinematics.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

struct AvatarPose {
  std::map<std::string, Eigen::Quaterniond> turn;  // by VRM bone, in Unity's axes
  Eigen::Vector3d hips = Eigen::Vector3d::Zero();
};

AvatarPose parse_avatar(const std::string& text) {
  AvatarPose pose;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    std::array<double, 4> value{};
    words >> name >> value[0] >> value[1] >> value[2] >> value[3];
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

}  // namespace

TEST_CASE("the C# client moves a Unity avatar as the clip that plays") {
  if (std::system("command -v mcs mono >/dev/null") != 0) {
    WARN("SKIPPED without mono-mcs and mono-runtime");
    return;
  }
  Served served;
  served.start();
  const std::string client = (source_dir() / "proto/clients/csharp").string();
  const std::string program = served.path("watch.exe");
  const std::string port = served.publish.substr(served.publish.rfind(':') + 1);
  const std::string command = "mcs -langversion:6 -warnaserror -out:'" + program + "' '" + client +
                              "'/*.cs '" + client + "'/test/*.cs && timeout 60 mono '" + program +
                              "' 127.0.0.1 " + port + " walker-raw 2>&1";
  const std::unique_ptr<FILE, int (*)(FILE*)> output(popen(command.c_str(), "r"), pclose);
  REQUIRE(output);
  std::string said;
  for (char line[512]; std::fgets(line, sizeof line, output.get()) != nullptr;) said += line;
  INFO(said);
  const AvatarPose avatar = parse_avatar(said);
  const clip::Clip clip = clip::read_clip(served.folder.path() / "walk.bvh").value();
  REQUIRE(avatar.turn.contains("hips"));
  double nearest_rad = 1.0;
  int nearest = 0;
  for (int i = 0; i < clip.frames(); ++i) {
    const double now_rad = off_rad(avatar, clip, i);
    if (now_rad < nearest_rad) {
      nearest_rad = now_rad;
      nearest = i;
    }
  }
  CHECK(nearest_rad < 1e-5);
  const Vec3f root_m = clip.frame(nearest).root_position_m;
  CHECK((avatar.hips - Eigen::Vector3d(-root_m[0], root_m[1], root_m[2])).norm() < 1e-5);
}

}  // namespace posed::test
