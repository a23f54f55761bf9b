// The commands that posed gives robot hands, judged by MuJoCo with the hands' own shapes.

#include <catch2/catch.hpp>

#include "tests/bench/robot/figures.hpp"
#include "tests/robot/judge/robot_judge.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

robot::RobotHand robot_of(const std::filesystem::path& path) {
  auto urdf = robot::parse_urdf(robot::load_urdf(path).value(), path).value();
  return robot::robot_hand(std::move(urdf), {}, path).value();
}

RobotVerdict judge_track(const std::filesystem::path& path, const robot::RobotHand& robot,
                         const bench::RobotTrack& track) {
  RobotPoses poses;
  for (const auto& joint : robot.joints) poses.joints.push_back(joint.name);
  for (const auto& pose : track.poses) poses.rows.push_back(bench::joint_angles(robot, pose));
  RobotJudge judge = RobotJudge::load(path).value();
  return judge.judge(poses);
}

void check_clear(const std::filesystem::path& path, const bench::HandTake& take) {
  const robot::RobotHand robot = robot_of(path);
  const auto tracks = bench::our_tracks(robot, take);
  const RobotVerdict verdict = judge_track(path, robot, tracks[1]);
  std::string contacts;
  for (const auto& [links, place] : verdict.contacts) {
    contacts += links.first + " + " + links.second + ": " + std::to_string(place.frames) +
                " frames, " + std::to_string(1e3 * place.worst) + " mm\n";
  }
  INFO(path.filename() << ", " << take.name << "\n" << contacts);
  CHECK(verdict.unknown_columns.empty());
  CHECK(verdict.beyond_limits == 0);
  CHECK(verdict.in_contact == 0);
}

}  // namespace

TEST_CASE("MuJoCo sees no contact in the commands of the mitten, and some in its rival's") {
  const auto path = source_dir() / "config/robots/mitten.urdf";
  const bench::HandTake take = bench::synthetic_take();
  check_clear(path, take);
  // Else the test says nothing.
  const robot::RobotHand robot = robot_of(path);
  CHECK(judge_track(path, robot, bench::rival_tracks(robot, take)[0]).in_contact > 0);
}

TEST_CASE("MuJoCo sees no contact in the commands of real hands") {
  const auto folder = shared("data/robots");
  if (!folder) SKIP_WITHOUT_SHARED();
  std::vector<bench::HandTake> takes{bench::synthetic_take()};
  if (const auto signs = shared("data/gloves/libras_cyberglove")) {
    takes.push_back(bench::signs_take(*signs).value());
  }
  for (const char* hand :
       {"allegro_hand/allegro_hand_right.urdf", "leap_hand/leap_hand_right.urdf",
        "inspire_hand/inspire_hand_right.urdf", "shadow_hand/shadow_hand_right.urdf",
        "schunk_hand/schunk_svh_hand_right.urdf", "ability_hand/ability_hand_right.urdf"}) {
    for (const bench::HandTake& take : takes) check_clear(*folder / hand, take);
  }
}

}  // namespace posed::test
