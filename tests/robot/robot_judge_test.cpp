// The judge itself: it must see what is wrong, or its silence would mean nothing.
#include "tests/robot/judge/robot_judge.hpp"

#include <fstream>
#include <string>

#include <catch2/catch.hpp>

#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

// A palm of 80 x 40 x 80 mm, above it a finger of two links that bends over its front, the second
// by -1.5 times the first and 0.1 more; the tip is a mesh that is not there.
constexpr const char* kHand = R"(<robot name="hand">
  <link name="palm"><collision><geometry><box size="0.08 0.04 0.08"/></geometry></collision></link>
  <joint name="distal" type="revolute">
    <parent link="first"/><child link="second"/><origin xyz="0 0 0.05"/><axis xyz="1 0 0"/>
    <limit lower="-0.1" upper="2.6" velocity="1" effort="1"/>
    <mimic joint="proximal" multiplier="-1.5" offset="0.1"/>
  </joint>
  <joint name="proximal" type="revolute">
    <parent link="palm"/><child link="first"/><origin xyz="0 0 0.05"/><axis xyz="-1 0 0"/>
    <limit lower="-1.8" upper="0.05" velocity="1" effort="1"/>
  </joint>
  <link name="first"><collision><origin xyz="0 0 0.025"/>
    <geometry><cylinder radius="0.006" length="0.03"/></geometry></collision></link>
  <link name="second"><collision><origin xyz="0 0 0.025"/>
    <geometry><cylinder radius="0.006" length="0.03"/></geometry></collision></link>
  <joint name="end" type="fixed"><parent link="second"/><child link="tip"/>
    <origin xyz="0 0 0.045"/></joint>
  <link name="tip"><visual><geometry><mesh filename="tip.glb"/></geometry></visual>
    <collision><geometry><mesh filename="package://hand/tip.stl"/></geometry></collision></link>
</robot>)";

RobotJudge judge_of(const std::string& text) {
  const TempFolder folder;
  const auto path = folder.path() / "hand.urdf";
  std::ofstream(path) << text;
  auto judge = RobotJudge::load(path);
  if (!judge) FAIL(judge.error().text());
  return std::move(*judge);
}

}  // namespace

TEST_CASE("MuJoCo sees a finger in the palm, and a follower beyond its limit") {
  RobotJudge judge = judge_of(kHand);
  CHECK(judge.links() == 4);
  CHECK(judge.without_shape() == std::vector<std::string>{"tip"});
  CHECK(judge.missing_meshes() == std::vector<std::string>{"tip.stl"});
  CHECK(judge.touching_at_start().empty());

  const RobotVerdict open = judge.judge({.joints = {"proximal"}, .rows = {{0.0}, {-0.3}}});
  CHECK(open.frames == 2);
  CHECK(open.in_contact == 0);
  CHECK(open.beyond_limits == 0);

  // The leader is within its limits, the follower is not.
  const RobotVerdict beyond = judge.judge({.joints = {"proximal"}, .rows = {{-0.3}, {-1.75}}});
  CHECK(beyond.beyond_limits == 1);
  CHECK(beyond.limits.at("distal").worst == Approx(1.5 * 1.75 + 0.1 - 2.6));

  const RobotVerdict closed = judge.judge({.joints = {"proximal"}, .rows = {{-0.3}, {-1.6}}});
  CHECK(closed.in_contact == 1);
  CHECK(closed.contacts.at({"palm", "second"}).worst > 0.002);

  const RobotVerdict odd = judge.judge({.joints = {"thumb"}, .rows = {{0.0}}});
  CHECK(odd.unknown_columns == std::vector<std::string>{"thumb"});
  CHECK(odd.still_joints == std::vector<std::string>{"proximal"});
  CHECK(judge.judge({.joints = {"proximal"}, .rows = {{NAN}}}).beyond_limits == 1);
}

TEST_CASE("MuJoCo reads the URDFs of real hands, and sees an index finger in the palm") {
  struct Hand {
    std::string path, palm, tip;
    RobotPoses fist;  // within the limits
  };
  for (const Hand& hand :
       {Hand{"allegro_hand/allegro_hand_right.urdf",
             "base_link",
             "link_3.0_tip",
             {.joints = {"joint_1.0", "joint_2.0", "joint_3.0"}, .rows = {{1.61, 1.709, 1.618}}}},
        Hand{"leap_hand/leap_hand_right.urdf",
             "palm_lower",
             "fingertip",
             {.joints = {"1", "2", "3"}, .rows = {{2.23, 1.885, 2.042}}}}}) {
    const auto path = shared("data/robots/" + hand.path);
    if (!path) return;
    INFO(hand.path);
    auto loaded = RobotJudge::load(*path);
    if (!loaded) FAIL(loaded.error().text());
    CHECK(loaded->joints() == 16);
    CHECK(loaded->missing_meshes().empty());
    const RobotVerdict start = loaded->judge({.joints = {}, .rows = {{}}});
    CHECK(start.in_contact == 0);
    CHECK(start.beyond_limits == 0);
    const RobotVerdict fist = loaded->judge(hand.fist);
    CHECK(fist.beyond_limits == 0);
    CHECK(fist.contacts.contains({hand.palm, hand.tip}));
  }
}

}  // namespace posed::test
