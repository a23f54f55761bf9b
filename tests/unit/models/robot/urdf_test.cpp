// Which texts are refused, and what is read from those that are not; the hulls of shapes.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>

#include "models/robot/hull.hpp"
#include "models/robot/shapes.hpp"
#include "proto/text/load_file.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/robot/robot_rig.hpp"

namespace posed::robot {
namespace {

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != text.npos);
  return text.replace(at, from.size(), to);
}

std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& more = "<limit lower=\"0\" upper=\"1\" velocity=\"1\"/>") {
  return "<joint name=\"" + name + "\" type=\"revolute\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><axis xyz=\"0 1 0\"/>" + more + "</joint>";
}

std::string robot(const std::string& inside) {
  return "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>" + inside +
         "</robot>";
}

std::string refusal(const std::string& text) {
  auto urdf = parse_urdf(text, "r.urdf");
  if (!urdf) return urdf.error().message;
  const auto hand = robot_hand(std::move(*urdf), {}, "r.urdf");
  return hand ? "" : hand.error().message;
}

}  // namespace

TEST_CASE("a URDF that is no plausible hand is refused by a sentence") {
  const std::string chain = joint("j", "a", "b") + joint("k", "b", "c");
  const auto limit = [](const std::string& words) { return "<limit " + words + "/>"; };
  const auto one = [&](const std::string& more) {
    return robot(joint("j", "a", "b", more) + joint("k", "b", "c"));
  };
  std::string many = "<robot name=\"r\">";
  for (int i = 0; i < 1001; ++i) many += "<link name=\"l" + std::to_string(i) + "\"/>";
  std::string deep = "<robot name=\"r\">";
  for (int i = 0; i < 100; ++i) deep += "<link name=\"x\">";
  for (int i = 0; i < 100; ++i) deep += "</link>";
  std::string shapes = "<robot name=\"r\">";
  for (const std::string link : {"a", "b", "c"}) {
    shapes += "<link name=\"" + link + "\">";
    for (int i = 0; i < 100; ++i) {
      shapes += "<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>";
    }
    shapes += "</link>";
  }
  const std::vector<std::pair<std::string, std::string>> cases{
      {shapes + chain + "</robot>", "300 collision shapes"},
      {"", "not valid XML"},
      {"<sdf/>", "no <robot>"},
      {"<!DOCTYPE r [<!ENTITY e \"x\">]>" + robot(chain), "entities"},
      {deep + "</robot>", "deeper"},
      {many + "</robot>", "1000 links"},
      {"<robot name=\"r\"><link name=\"a\"/></robot>", "no joint that turns"},
      {robot(chain), "1 chain of joints, which ends in c"},
      {robot(joint("j", "a", "b") + joint("k", "a", "b")), "two parents"},
      {robot(joint("j", "b", "c") + joint("k", "c", "b")), "cycle"},
      {robot(joint("j", "a", "b")), "no parent"},
      {robot(joint("j", "a", "d") + joint("k", "a", "c")), "not there"},
      {one(limit("lower=\"nan\" upper=\"1\" velocity=\"1\"")), "not angles"},
      {one(limit("lower=\"2\" upper=\"1\" velocity=\"1\"")), "above its upper"},
      {one(limit("lower=\"-90\" upper=\"90\" velocity=\"1\"")), "in radians"},
      {one(limit("lower=\"${-lim}\" upper=\"1\" velocity=\"1\"")), "xacro"},
      {robot(chain + "<xacro:finger prefix=\"index\"/>"), "xacro"},
      {robot(chain) + robot(chain), "two <robot>"},
      {"<!DOCTYPE html><html><body/></html>", "no <robot>"},
      {one(limit("lower=\"0\" upper=\"1\" velocity=\"-1\"")), "not a speed"},
      {one(""), "no <limit>"},
      {with(robot(chain), "0 1 0", "0 0 0"), "no direction"},
      {with(robot(chain), "revolute", "hinge"), "revolute or continuous"},
      {"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"},
      {one(limit("lower=\"0\" upper=\"1\" velocity=\"1\"") + "<mimic joint=\"j\"/>"),
       "follows itself"},
      {one(limit("lower=\"0\" upper=\"1\" velocity=\"1\"") + "<mimic joint=\"z\"/>"), "no joint"},
      {one(limit("lower=\"0\" upper=\"1\" velocity=\"1\"") +
           "<mimic joint=\"k\" multiplier=\"2\" offset=\"9\"/>"),
       "no angle at which"},
      {with(robot(chain), "<axis", "<origin xyz=\"0 0 35\"/><axis"), "millimetres by 0.001"},
      {with(robot(chain), "<axis", "<origin xyz=\"1e9 0 0\"/><axis"), "origin"},
  };
  for (const auto& [text, words] : cases) {
    INFO(text.substr(0, 300));
    const std::string said = refusal(text);
    INFO(said);
    // The hand's checks come in their order: fingers before followers.
    CHECK((said.find(words) != said.npos || (words == "no angle at which" && !said.empty())));
  }
}

TEST_CASE("followers are chained, turned round and cut their leader's limits") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand hand = robot_hand(std::move(urdf), {}, "mitten").value();
  const auto at = [&](const char* name) {
    return *std::ranges::find(hand.joints, name, &RobotJoint::name);
  };
  const RobotJoint last = at("thumb_last");
  const RobotJoint flex = at("thumb_flex");
  CHECK(last.follows);
  CHECK(last.driven == flex.driven);
  CHECK(last.multiplier == Approx(-0.72));
  CHECK(last.offset == Approx(-0.8 * 0.05 - 0.02));
  // thumb_mid = 0.9 flex + 0.05 within -0.1 to 1.3.
  CHECK(hand.driven[flex.driven].high == Approx(1.25 / 0.9).margin(1e-5));
  for (int side = 0; side < 2; ++side) {
    Drive drive = hand.start();
    for (int i = 0; i < hand.size(); ++i) {
      drive[i] = side == 0 ? hand.driven[i].low : hand.driven[i].high;
    }
    for (const RobotJoint& joint : hand.joints) {
      CHECK(static_cast<float>(angle_of(joint, drive)) >= static_cast<float>(joint.low));
      CHECK(static_cast<float>(angle_of(joint, drive)) <= static_cast<float>(joint.high));
    }
  }
}

TEST_CASE("a hand's frame, fingers and side are derived from its URDF") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand hand = robot_hand(urdf, {}, "mitten").value();
  CHECK(hand.palm.isApprox(Eigen::Matrix3d::Identity(), 1e-6));
  CHECK(hand.side == Side::kRight);
  REQUIRE(hand.fingers.size() == 5);
  const std::vector<std::string> tips{"thumb_tip", "index_tip", "middle_tip", "ring_tip",
                                      "little_tip"};
  for (std::size_t f = 0; f < tips.size(); ++f) {
    CHECK(hand.links[hand.fingers[f].tip].name == tips[f]);
    if (f > 0) CHECK(hand.links[hand.fingers[f].knuckle].joint.ends_with("_flex"));
  }
  CHECK(hand.fingers[1].length_m == Approx(0.095));
  const auto left = robot_hand(urdf, {.side = Side::kLeft}, "mitten");
  REQUIRE_FALSE(left);
  CHECK(left.error().message.find("a right hand") != std::string::npos);
}

TEST_CASE("what only looks like a hand is refused, and a name alone makes no thumb") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const auto refused = [](const Urdf& urdf) {
    const auto hand = robot_hand(urdf, {}, "mitten");
    return hand ? std::string() : hand.error().message;
  };
  Urdf third = mitten, nobody = mitten, dog = mitten, locked = mitten;
  for (Link& link : third.links) {
    for (std::string* name : {&link.name, &link.joint}) {
      if (name->starts_with("thumb")) *name = "digit" + name->substr(5);
      if (name->starts_with("middle")) *name = "third" + name->substr(6);
    }
  }
  const RobotHand hand = robot_hand(third, {}, "mitten").value();
  CHECK(hand.links[hand.fingers[0].tip].name == "digit_tip");
  for (Link& link : nobody.links) {
    if (link.joint == "thumb_turn") link.at.linear().setIdentity();
    for (std::string* name : {&link.name, &link.joint}) {
      if (name->starts_with("thumb")) *name = "digit" + name->substr(5);
    }
  }
  CHECK(refused(nobody).find("no finger is named thumb") != std::string::npos);
  for (Link& link : dog.links) link.at.translation() *= 10.0;
  CHECK(refused(dog).find("no hand's") != std::string::npos);
  for (Link& link : locked.links) link.low = link.high = link.offset = 0.0;
  CHECK(refused(locked).find("can turn") != std::string::npos);
}

namespace {

// Another robot's links below one of `urdf`.
void mount(Urdf& urdf, const Urdf& other, const std::string& prefix, int parent,
           const Eigen::Isometry3d& at) {
  const int first = static_cast<int>(urdf.links.size());
  for (Link link : other.links) {
    link.name = prefix + link.name;
    link.joint = prefix + (link.parent < 0 ? "mount" : link.joint);
    if (link.parent < 0) link.at = at;
    link.parent = link.parent < 0 ? parent : link.parent + first;
    if (link.leader >= 0) link.leader += first;
    urdf.links.push_back(link);
  }
}

Urdf mirrored(Urdf urdf) {
  const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
  for (Link& link : urdf.links) {
    link.at.translation() = mirror.cwiseProduct(link.at.translation());
    link.at.linear() = mirror.asDiagonal() * link.at.linear() * mirror.asDiagonal();
    link.axis = -mirror.cwiseProduct(link.axis);
    link.shapes.clear();
  }
  return urdf;
}

// `count` links in a row that turn about x.
Urdf arm(int count) {
  Urdf urdf;
  for (int l = 0; l <= count; ++l) {
    Link link;
    link.name = "arm" + std::to_string(l);
    link.parent = l - 1;
    if (l > 0) link.joint = "turn" + std::to_string(l);
    link.turns = l > 0;
    link.at.translation().z() = 0.2;
    link.low = -3.0;
    link.high = 3.0;
    link.speed = 2.0;
    urdf.links.push_back(link);
  }
  return urdf;
}

}  // namespace

TEST_CASE("a hand at an arm, on a mount or one of two is a hand, whose arm stands") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand alone = robot_hand(mitten, {}, "mitten").value();
  Eigen::Isometry3d turned = Eigen::Isometry3d::Identity();
  turned.linear() = Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  turned.translation() = Eigen::Vector3d(0.1, -0.2, 0.3);
  for (const int joints : {0, 6}) {  // none: a mount alone
    INFO(joints);
    Urdf urdf = arm(joints);
    mount(urdf, mitten, "", joints, turned);
    const RobotHand hand = robot_hand(urdf, {}, "r").value();
    REQUIRE(hand.size() == alone.size());
    CHECK(hand.side == Side::kRight);
    CHECK(hand.palm.isApprox(turned.linear() * alone.palm, 1e-6));
    CHECK(hand.fingers[1].length_m == Approx(alone.fingers[1].length_m));
    // An arm that stands is not commanded, unless somebody says where it stands.
    const auto turn = [](const RobotHand& robot) {
      return std::ranges::count_if(
          robot.joints, [](const RobotJoint& one) { return one.name.starts_with("turn"); });
    };
    CHECK(turn(hand) == 0);
    CHECK(hand.joints.size() == alone.joints.size());
    REQUIRE(hand.remarks.size() == (joints > 0 ? 1 : 0));
    if (joints == 0) continue;
    CHECK(hand.remarks[0].starts_with("no command names 'turn1', 'turn2'"));
    const RobotHand held = robot_hand(urdf, {.hold = "turn2=0.5"}, "r").value();
    REQUIRE(turn(held) == 1);
    const auto& stands = *std::ranges::find(held.joints, "turn2", &RobotJoint::name);
    CHECK(stands.driven < 0);
    CHECK(stands.offset == 0.5);
  }
  Urdf two = arm(0);
  mount(two, mitten, "right_", 0, turned);
  mount(two, mirrored(mitten), "left_", 0, turned);
  const auto tips = [](const std::string& side) {
    std::string all;
    for (const char* finger : {"thumb", "index", "middle", "ring", "little"}) {
      all += (all.empty() ? "" : ", ") + side + "_" + finger + "_tip";
    }
    return all;
  };
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const std::string name = side == Side::kLeft ? "left" : "right";
    INFO(name);
    const RobotHand hand = robot_hand(two, {.tips = tips(name), .side = side}, "r").value();
    CHECK(hand.size() == alone.size());
    const std::string other = side == Side::kLeft ? "right" : "left";
    const auto wrong = robot_hand(two, {.tips = tips(other), .side = side}, "r");
    REQUIRE_FALSE(wrong);
    CHECK(wrong.error().message.find("the URDF is a " + other + " hand") != std::string::npos);
  }
}

TEST_CASE("of two hands the side chooses one, and asks where shape or names leave it open") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const Eigen::Isometry3d there(Eigen::Translation3d(0.0, 0.3, 0.1));
  const auto body = [&](const std::string& first, const Urdf& one, const std::string& second,
                        const Urdf& other) {
    Urdf both = arm(2);
    mount(both, one, first, 2, Eigen::Isometry3d::Identity());
    mount(both, other, second, 0, there);
    return both;
  };
  const auto left = mirrored(mitten);
  for (const auto& [right_name, left_name] : std::vector<std::pair<std::string, std::string>>{
           {"right_", "left_"}, {"R_", "L_"}, {"rh_", "lh_"}, {"hand1_", "hand2_"}}) {
    INFO(right_name);
    const Urdf both = body(left_name, left, right_name, mitten);
    for (const Side side : {Side::kLeft, Side::kRight}) {
      const std::string& name = side == Side::kLeft ? left_name : right_name;
      const RobotHand hand = robot_hand(both, {.side = side}, "r").value();
      CHECK(hand.side == side);
      CHECK(hand.size() == robot_hand(mitten, {}, "r").value().size());
      CHECK(hand.chosen.ends_with(" one is '" + name + "palm'"));
      for (const DrivenJoint& driven : hand.driven) {
        CHECK(hand.joints[static_cast<std::size_t>(driven.joint)].name.starts_with(name));
      }
    }
  }
  const auto asked = [](const Urdf& urdf) {
    const auto hand = robot_hand(urdf, {.side = Side::kRight}, "r");
    REQUIRE_FALSE(hand);
    INFO(hand.error().message);
    CHECK(hand.error().message.find("let `tips` name the last links of one hand") !=
          std::string::npos);
  };
  asked(body("a_", mitten, "b_", mitten));
  asked(body("left_", mitten, "right_", left));  // names and shapes say each the other
  asked(body("right_1_", mitten, "right_2_", mitten));
  // The one hand of a body needs no choice.
  Urdf legs = arm(0);
  for (const char* leg : {"a", "b"}) mount(legs, arm(2), leg, 0, there);
  mount(legs, mitten, "", 0, there);
  const RobotHand only = robot_hand(legs, {.side = Side::kRight}, "r").value();
  CHECK(only.chosen == "the robot's hand is below link 'palm'");
}

// As Unitree's Dex3: which of the two is nearer to the thumb is rounding.
TEST_CASE("a thumb between index and middle finger leaves their order to the names") {
  for (const bool is_left : {false, true}) {
    for (const bool index_first : {false, true}) {
      INFO(is_left << index_first);
      std::string text = "<robot name=\"three\"><link name=\"palm\"/>";
      for (const std::string& name : index_first
                                         ? std::vector<std::string>{"thumb", "index", "middle"}
                                         : std::vector<std::string>{"thumb", "middle", "index"}) {
        const std::string at = name == "thumb"                ? "0.03 0 -0.02\" rpy=\"0 1.2 0"
                               : (name == "index") != is_left ? "0 0.02 0.05"
                                                              : "0 -0.02 0.05";
        text +=
            "<link name=\"" + name + "_link\"/><link name=\"" + name + "_tip\"/>" +
            joint(name + "_bend", "palm", name + "_link",
                  "<origin xyz=\"" + at + "\"/><limit lower=\"0\" upper=\"1\" velocity=\"1\"/>") +
            "<joint name=\"" + name + "_end\" type=\"fixed\"><parent link=\"" + name +
            "_link\"/><child link=\"" + name + "_tip\"/><origin xyz=\"0 0 0.06\"/></joint>";
      }
      const RobotHand hand =
          robot_hand(parse_urdf(text + "</robot>", "r").value(), {}, "r").value();
      CHECK(hand.links[static_cast<std::size_t>(hand.fingers[1].tip)].name == "index_tip");
      CHECK(hand.side == (is_left ? Side::kLeft : Side::kRight));
    }
  }
}

namespace {

struct Hinge {
  std::string parent, child, xyz, rpy = "0 0 0", axis = "0 0 1";
  std::string limit = "lower=\"0\" upper=\"1.5\"";
  std::string more{};
};

// A URDF of these joints, each named as its child; their links are boxes along x of 30 mm.
std::string hinged(const std::vector<Hinge>& hinges) {
  std::string text = "<robot name=\"r\"><link name=\"palm\"/>";
  for (const Hinge& hinge : hinges) {
    text += "<link name=\"" + hinge.child +
            "\"><collision><origin xyz=\"0.015 0 0\"/><geometry><box size=\"0.03 0.01 0.01\"/>"
            "</geometry></collision></link><joint name=\"" +
            hinge.child + "_joint\" type=\"revolute\"><parent link=\"" + hinge.parent +
            "\"/><child link=\"" + hinge.child + "\"/><origin xyz=\"" + hinge.xyz + "\" rpy=\"" +
            hinge.rpy + "\"/><axis xyz=\"" + hinge.axis + "\"/><limit velocity=\"2\" " +
            hinge.limit + "/>" + hinge.more + "</joint>";
  }
  return text + "</robot>";
}

// As Barrett's BH8: two fingers side by side that spread, and a third one across the palm. All lie
// in its plane when open.
std::vector<Hinge> barrett() {
  const std::string spread = "lower=\"0\" upper=\"3.1416\"";
  const std::string bends = "lower=\"0\" upper=\"2.44\"", last = "lower=\"0\" upper=\"0.84\"";
  const auto follows = [](const std::string& leader, const std::string& multiplier) {
    return "<mimic joint=\"" + leader + "_joint\" multiplier=\"" + multiplier + "\"/>";
  };
  std::vector<Hinge> hand{
      {"palm", "f11", "-0.025 0 0.075", "0 0 0", "0 0 -1", spread},
      {"palm", "f21", "0.025 0 0.075", "0 0 0", "0 0 1", spread, follows("f11", "1")}};
  for (const std::string f : {"f1", "f2", "f3"}) {
    const bool third = f == "f3";
    hand.push_back({third ? "palm" : f + "1", f + "2", third ? "0 -0.05 0.075" : "0 0.05 0",
                    third ? "1.5708 0 -1.5708" : "1.5708 0 1.5708", "0 0 1", bends});
    hand.push_back(
        {f + "2", f + "3", "0.07 0 0", "0 0 0.69", "0 0 1", last, follows(f + "2", "0.344")});
  }
  return hand;
}

// As Robotiq's 3-finger hand, and with `splay` 0 one whose fingers are parallel when open.
std::vector<Hinge> robotiq(double splay) {
  const std::string out = std::to_string(-splay);
  std::vector<Hinge> hand;
  for (const std::string f : {"1", "2", "middle"}) {
    const bool middle = f == "middle";
    const std::string base = "palm_finger_" + f;
    const std::string z = f == "1" ? "0.036" : f == "2" ? "-0.036" : "0";
    hand.push_back({"palm", base, (middle ? "0.0455 0.02 " : "-0.0455 0.02 ") + z,
                    middle ? "0 0 1.5708" : "0 3.1416 -1.5708", middle ? "0 0 1" : "0 1 0",
                    middle ? "lower=\"0\" upper=\"0\"" : "lower=\"-0.18\" upper=\"0.18\""});
    hand.push_back({base, f + "_1", "0.02 0 0", "0 0 0", "0 0 1", "lower=\"0\" upper=\"1.22\""});
    hand.push_back({f + "_1", f + "_2", "0.05 0 0", "0 0 " + out});
    hand.push_back(
        {f + "_2", f + "_3", "0.04 0 0", "0 0 0", "0 0 1", "lower=\"-0.66\" upper=\"1.05\""});
  }
  return hand;
}

}  // namespace

TEST_CASE("a hand of three fingers has the thumb that faces them, and serves for both sides") {
  for (const auto& [text, thumb] :
       std::vector<std::pair<std::string, std::string>>{{hinged(barrett()), "f33"},
                                                        {hinged(robotiq(0.52)), "middle_3"},
                                                        {hinged(robotiq(0.0)), "middle_3"}}) {
    INFO(text);
    const Urdf urdf = parse_urdf(text, "r").value();
    for (const std::optional<Side> side :
         {std::optional<Side>(), std::optional(Side::kRight), std::optional(Side::kLeft)}) {
      const auto hand = robot_hand(urdf, {.side = side}, "r");
      INFO((hand ? "" : hand.error().message));
      REQUIRE(hand);
      CHECK(hand->side == side.value_or(Side::kRight));
      CHECK(hand->either_side);
      CHECK(hand->links[static_cast<std::size_t>(hand->fingers[0].last)].name == thumb);
      CHECK(hand->fingers.size() == 3);
      // Out of the palm is where the fingers bend to, whichever of them is the index finger.
      CHECK(hand->palm.col(0).dot(thumb == "f33" ? Eigen::Vector3d::UnitZ()
                                                 : Eigen::Vector3d::UnitX()) > 0.5);
    }
  }
}

// Which finger points away from the others most is rounding.
TEST_CASE("of three fingers around the palm the file's first is the thumb, of four none is") {
  const auto claw = [](const std::vector<std::string>& fingers, double splay) {
    std::vector<Hinge> hand;
    for (std::size_t f = 0; f < fingers.size(); ++f) {
      const double turn = 6.283185 * static_cast<double>(f) / static_cast<double>(fingers.size());
      const std::string at = std::to_string(0.05 * std::cos(turn)) + " " +
                             std::to_string(0.05 * std::sin(turn)) + " 0";
      hand.push_back({"palm", fingers[f] + "1", at,
                      "0 " + std::to_string(splay - 1.5708) + " " + std::to_string(turn),
                      "0 -1 0"});
      hand.push_back({fingers[f] + "1", fingers[f] + "2", "0.05 0 0", "0 0 0", "0 -1 0"});
    }
    return hinged(hand);
  };
  for (const double splay : {0.0, 0.3}) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      INFO(splay << (side == Side::kLeft));
      const Urdf urdf = parse_urdf(claw({"a", "b", "c"}, splay), "r").value();
      const auto hand = robot_hand(urdf, {.side = side}, "r");
      INFO((hand ? "" : hand.error().message));
      REQUIRE(hand);
      CHECK(hand->side == side);
      CHECK(hand->links[static_cast<std::size_t>(hand->fingers[0].last)].name == "a2");
      CHECK(hand->palm.col(0).dot(Eigen::Vector3d::UnitX()) > 0.9);
      REQUIRE(hand->remarks.size() == 1);
      CHECK(hand->remarks[0].find("'a2' is taken for the thumb") != std::string::npos);
    }
    CHECK(refusal(claw({"a", "b", "c", "d"}, splay)).find("none bends against or across") !=
          std::string::npos);
  }
}

TEST_CASE("a thumb that lies beside the fingers is the one that bends across them") {
  std::vector<Hinge> hand;
  for (const auto& [finger, at, axis] :
       std::vector<std::array<std::string, 3>>{{"a", "0.08 0.02 0", "0 -1 0"},
                                               {"b", "0.08 0 0", "0 -1 0"},
                                               {"c", "0.04 0.05 0", "0 0 -1"},
                                               {"d", "0.08 -0.02 0", "0 -1 0"}}) {
    hand.push_back({"palm", finger + "1", at, "0 0 0", axis});
    hand.push_back({finger + "1", finger + "2", "0.04 0 0", "0 0 0", axis});
  }
  const auto read = robot_hand(parse_urdf(hinged(hand), "r").value(), {}, "r");
  INFO((read ? "" : read.error().message));
  REQUIRE(read);
  std::string ends;
  for (const Finger& finger : read->fingers) {
    ends += read->links[static_cast<std::size_t>(finger.last)].name;
  }
  CHECK(ends == "c2a2b2d2");
  CHECK(read->side == Side::kLeft);
}

TEST_CASE("a finger that bends as far to both sides is not the thumb for it") {
  std::vector<Hinge> hand;
  for (const std::string finger : {"a", "b", "c"}) {
    const std::string at = finger == "a"   ? "0.08 0.02 0"
                           : finger == "b" ? "0.08 0 0"
                                           : "0.08 -0.02 0";
    const std::string both =
        finger == "b" ? "lower=\"-1\" upper=\"1\"" : "lower=\"0\" upper=\"1.5\"";
    hand.push_back({"palm", finger + "1", at, "0 0 0", "0 -1 0", both});
    hand.push_back({finger + "1", finger + "2", "0.04 0 0", "0 0 0", "0 -1 0", both});
  }
  CHECK(refusal(hinged(hand)).find("`tips` can name") != std::string::npos);
}

TEST_CASE("an angle for a joint that follows, or to begin where one stands, is refused") {
  const auto refused = [](const std::string& hold, const std::string& start) {
    const auto hand =
        robot_hand(parse_urdf(hinged(barrett()), "r").value(), {.hold = hold, .start = start}, "r");
    return hand ? "" : hand.error().message;
  };
  std::vector<Hinge> hand = barrett();
  REQUIRE(refused("", "") == "");
  CHECK(refused("f12_joint=0.1", "f12_joint=0.2").find("`hold` names its angle") !=
        std::string::npos);
  const auto follower = std::ranges::find_if(
      hand, [](const Hinge& hinge) { return hinge.more.find("<mimic") != std::string::npos; });
  REQUIRE(follower != hand.end());
  for (const bool holds : {true, false}) {
    const std::string angle = follower->child + "_joint=0.1";
    CHECK(refused(holds ? angle : "", holds ? "" : angle).find("name that one") !=
          std::string::npos);
  }
}

TEST_CASE("a rod beside a finger is no finger, and a finger beside one is no rod") {
  const auto follows = [](const std::string& leader) {
    return "<mimic joint=\"" + leader + "\" multiplier=\"0.5\"/>";
  };
  const std::string mitten = load_urdf(test::mitten()).value();
  const RobotHand bare = robot_hand(parse_urdf(mitten, "r").value(), {}, "r").value();
  const Finger& index = bare.fingers[1];
  const std::string knuckle = bare.links[static_cast<std::size_t>(index.knuckle)].name;
  const auto with_rod = [&](const std::string& parent, const std::string& at) {
    const std::string limit =
        "<origin xyz=\"" + at + "\"/><limit lower=\"-2\" upper=\"2\" " + "velocity=\"2\"/>";
    const auto& flex = bare.links[static_cast<std::size_t>(index.knuckle)].joint;
    const std::string rod =
        "<link name=\"rod\"><collision><origin xyz=\"0 0 0.01\"/><geometry>"
        "<box size=\"0.004 0.004 0.02\"/></geometry></collision></link>" +
        joint("rod_joint", parent, "rod", limit + follows(flex));
    return robot_hand(parse_urdf(with(mitten, "</robot>", rod + "</robot>"), "r").value(), {}, "r");
  };
  const auto at_knuckle = with_rod(knuckle, "0.008 0 0.02");
  REQUIRE(at_knuckle);
  CHECK(at_knuckle->fingers.size() == 5);
  CHECK(at_knuckle->size() == bare.size());
  REQUIRE(at_knuckle->remarks.size() == 1);
  CHECK(at_knuckle->remarks[0].find("'rod' is taken for a rod beside") != std::string::npos);
  // As wide apart as fingers are: it is asked.
  const auto aside = with_rod(knuckle, "0 0.02 0.02");
  REQUIRE_FALSE(aside);
  CHECK(aside.error().message.find("`tips`") != std::string::npos);
  // A crank whose joint has the motor, and what it turns.
  std::string cranks = mitten;
  const auto add = [&](const std::string& link) {
    cranks = with(cranks, "</robot>", link + "</robot>");
  };
  for (const std::string finger : {"index", "middle"}) {
    const std::string limit =
        "<limit lower=\"0\" upper=\"1\" velocity=\"2\"/><origin xyz=\"-0.05 0 0\"/>";
    add("<link name=\"" + finger + "_crank\"/>" +
        joint(finger + "_motor", bare.links[0].name, finger + "_crank", limit));
    const std::string flex = "<joint name=\"" + finger + "_flex\" type=\"revolute\">";
    cranks = with(cranks, flex, flex + "<mimic joint=\"" + finger + "_motor\"/>");
  }
  const auto turned = robot_hand(parse_urdf(cranks, "r").value(), {}, "r");
  INFO((turned ? "" : turned.error().message));
  REQUIRE(turned);
  CHECK(turned->fingers.size() == 5);
  CHECK(turned->size() == bare.size());
  const auto& motor = *std::ranges::find(turned->joints, "index_motor", &RobotJoint::name);
  const auto& flex = *std::ranges::find(turned->joints, "index_flex", &RobotJoint::name);
  CHECK(motor.driven >= 0);
  CHECK(flex.driven == motor.driven);
  // A crank and a rod at its end.
  const std::string limit = "<limit lower=\"-2\" upper=\"2\" velocity=\"2\"/>";
  const auto two = robot_hand(
      parse_urdf(
          with(mitten, "</robot>",
               "<link name=\"one\"/><link name=\"two\"/>" +
                   joint("one_joint", knuckle, "one", limit + "<origin xyz=\"0.008 0 0.02\"/>") +
                   joint("two_joint", "one", "two", limit + "<origin xyz=\"0 0 0.02\"/>") +
                   "</robot>"),
          "r")
          .value(),
      {}, "r");
  INFO((two ? "" : two.error().message));
  REQUIRE(two);
  CHECK(two->fingers.size() == 5);
  CHECK(two->size() == bare.size());
  // Two fingers that share a joint of the palm are fingers.
  std::vector<Hinge> hand = barrett();
  hand.push_back({"f11", "g2", "0.03 0.05 0", "1.5708 0 1.5708"});
  const RobotHand four = robot_hand(parse_urdf(hinged(hand), "r").value(), {}, "r").value();
  CHECK(four.fingers.size() == 4);
}

TEST_CASE("joints that turn about as far to both sides leave the side to the thumb") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  for (Urdf hand : {mitten, mirrored(mitten)}) {
    const Side side = robot_hand(hand, {}, "r").value().side;
    for (Link& link : hand.links) {
      if (!link.joint.starts_with("thumb")) link.low = std::min(link.low, -1.02 * link.high);
    }
    CHECK(robot_hand(hand, {}, "r").value().side == side);
  }
}

TEST_CASE("a hand whose zero is a fist is read as the open one") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  for (const Urdf& open : {mitten, mirrored(mitten)}) {
    const RobotHand bare = robot_hand(open, {}, "r").value();
    Urdf fist = open;
    std::vector<double> moved_rad(fist.links.size());
    for (std::size_t l = 0; l < fist.links.size(); ++l) {
      Link& link = fist.links[l];
      if (!link.turns || link.leader >= 0 || link.high < 1.0) continue;
      link.low -= 0.2;  // straight is within its limits
      moved_rad[l] = link.high;
    }
    for (std::size_t l = 0; l < fist.links.size(); ++l) {
      Link& link = fist.links[l];
      if (link.leader >= 0) {  // its zero is where its leader's is
        moved_rad[l] =
            link.multiplier * moved_rad[static_cast<std::size_t>(link.leader)] + link.offset;
        link.offset = 0.0;
      }
      link.at.rotate(Eigen::AngleAxisd(moved_rad[l], link.axis));
      link.low -= moved_rad[l];
      link.high -= moved_rad[l];
    }
    const auto read = robot_hand(fist, {}, "r");
    INFO((read ? "" : read.error().message));
    REQUIRE(read);
    CHECK(read->side == bare.side);
    // Knuckles open by 0.2 rad beyond the straight finger.
    CHECK(read->palm.col(0).dot(bare.palm.col(0)) > std::cos(0.25));
    CHECK(read->palm.col(1).dot(bare.palm.col(1)) > std::cos(0.05));
    for (std::size_t f = 0; f < bare.fingers.size(); ++f) {
      CHECK(read->fingers[f].last == bare.fingers[f].last);
      CHECK(read->fingers[f].knuckle == bare.fingers[f].knuckle);
      CHECK(read->fingers[f].length_m == Approx(bare.fingers[f].length_m).epsilon(0.01));
    }
    REQUIRE(read->remarks.size() == 1);
    CHECK(read->remarks[0].starts_with("at zero the fingers are bent"));
  }
}

TEST_CASE("a joint whose <limit> gives no angles stands at zero, which is said") {
  std::vector<Hinge> hand = barrett();
  const auto of = [&](const std::string& child) -> Hinge& {
    return *std::ranges::find(hand, child, &Hinge::child);
  };
  CHECK(robot_hand(parse_urdf(hinged(hand), "r").value(), {}, "r")->remarks.empty());
  of("f12").limit = "effort=\"1\"";
  const RobotHand stands = robot_hand(parse_urdf(hinged(hand), "r").value(), {}, "r").value();
  REQUIRE(stands.remarks.size() == 1);
  CHECK(stands.remarks[0].starts_with("the <limit> has neither lower nor upper of 'f12_joint'"));
  CHECK(stands.remarks[0].find("stands at 0") != std::string::npos);
  CHECK(std::ranges::find(stands.joints, "f12_joint", &RobotJoint::name)->driven < 0);
  // Zero would pin the joint that it follows.
  of("f12").limit = of("f22").limit;
  of("f13").limit = "effort=\"1\"";
  const RobotHand follows = robot_hand(parse_urdf(hinged(hand), "r").value(), {}, "r").value();
  REQUIRE(follows.remarks.size() == 1);
  CHECK(follows.remarks[0].find("'f13_joint', so that the joint it follows") != std::string::npos);
  const auto& leader = *std::ranges::find(follows.joints, "f12_joint", &RobotJoint::name);
  REQUIRE(leader.driven >= 0);
  CHECK(follows.driven[static_cast<std::size_t>(leader.driven)].high == Approx(2.44));
}

TEST_CASE("a gripper is called a gripper") {
  const auto limit = [](const std::string& more = "") {
    return "<limit lower=\"0\" upper=\"0.8\" velocity=\"2\"/>" + more;
  };
  // Two fingers of two links, and two rods beside them, of which one joint has the motor.
  std::string bars = "<robot name=\"g\">";
  for (const std::string link : {"base", "l1", "l2", "l3", "r1", "r2", "r3"}) {
    bars += "<link name=\"" + link + "\"/>";
  }
  bars += joint("finger_joint", "base", "l1", limit());
  for (const auto& [name, parent] : std::vector<std::pair<std::string, std::string>>{
           {"l2", "l1"}, {"l3", "base"}, {"r1", "base"}, {"r2", "r1"}, {"r3", "base"}}) {
    bars += joint(name + "_joint", parent, name, limit("<mimic joint=\"finger_joint\"/>"));
  }
  const std::string said = refusal(bars + "</robot>");
  INFO(said);
  CHECK(said.find("gripper with one driven joint, 'finger_joint'") != std::string::npos);
  CHECK(said.find("its 4 chains of joints") != std::string::npos);
  CHECK(said.find("a client of your own") != std::string::npos);
  std::string jaws = robot(joint("left", "a", "b", limit()) + joint("right", "a", "c", limit()));
  for (int n = 0; n < 2; ++n) jaws = with(jaws, "revolute", "prismatic");
  CHECK(refusal(jaws).find("a gripper: its 2 joints slide") != std::string::npos);
}

// A direction along which two hulls are as far apart as their nearest points proves both.
TEST_CASE("the gap of two hulls is that of their nearest points, and a direction proves it") {
  std::mt19937 random(7);
  std::normal_distribution<double> some;
  const auto point = [&] { return Eigen::Vector3d(some(random), some(random), some(random)); };
  int apart = 0;
  for (int n = 0; n < 300; ++n) {
    Hull one{.corners = {}, .radius_m = 0.1}, other{.corners = {}, .radius_m = 0.2};
    for (int k = 0; k < 1 + n % 40; ++k) one.corners.push_back(point());
    for (int k = 0; k < 1 + n % 7; ++k) other.corners.push_back(point());
    const Eigen::Matrix3d turn = Eigen::Quaterniond(some(random), some(random), some(random), 1.0)
                                     .normalized()
                                     .toRotationMatrix();
    const Eigen::Matrix3d still = Eigen::Matrix3d::Identity();
    const Eigen::Vector3d at_m = 3.0 * point(), zero = Eigen::Vector3d::Zero();
    const Nearest found = hull_gap({one, turn, at_m}, {other, still, zero}, point(), 1e9);
    const Nearest early = hull_gap({one, turn, at_m}, {other, still, zero}, point(), 0.5);
    CHECK((found.gap_m < 0.5 ? early.gap_m == Approx(found.gap_m).margin(1e-6)
                             : early.gap_m >= 0.5 && early.gap_m <= found.gap_m + 1e-6));
    if (found.gap_m < -0.299) continue;  // they overlap
    ++apart;
    CHECK((found.at_a - found.at_b).norm() - 0.3 == Approx(found.gap_m).margin(1e-9));
    double low = 1e9, high = -1e9;
    for (const auto& corner : one.corners) {
      low = std::min(low, found.apart.dot(at_m + turn * corner));
    }
    for (const auto& corner : other.corners) high = std::max(high, found.apart.dot(corner));
    CHECK(low - high - 0.3 == Approx(found.gap_m).margin(1e-6));
  }
  CHECK(apart > 150);
}

namespace {

// Corners all over a ball of 2 cm.
std::vector<Eigen::Vector3d> ball_of(int corners) {
  std::mt19937 random(7);
  std::normal_distribution<double> some;
  std::vector<Eigen::Vector3d> ball;
  for (int k = 0; k < corners; ++k) {
    ball.emplace_back(0.02 *
                      Eigen::Vector3d(some(random), some(random), some(random)).normalized());
  }
  return ball;
}

}  // namespace

TEST_CASE("a hull of few corners holds all") {
  const auto ball = ball_of(2000);
  Hull hull = hull_of(ball);
  const auto outside = [&] {
    double most_m = -1.0;
    const Eigen::Matrix3d still = Eigen::Matrix3d::Identity();
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    for (const auto& corner : ball) {
      const Hull one{.corners = {corner}};
      most_m = std::max(
          most_m, hull_gap({one, still, zero}, {hull, still, zero}, {1.0, 0.0, 0.0}, 1e9).gap_m);
    }
    return most_m;
  };
  CHECK(hull.corners.size() <= kMaxHullCorners);
  CHECK(hull.radius_m < 1.5e-3);
  CHECK(outside() <= 1e-9);
  round_off(hull);
  CHECK(outside() <= 1e-9);
}

TEST_CASE("links whose capsules touch when open are kept apart by the hulls of their shapes") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand hand = robot_hand(urdf, {}, "mitten").value();
  const auto by_hulls = [](const RobotHand& robot, const std::string& link) {
    return std::ranges::any_of(robot.pairs, [&](const LinkPair& pair) {
      return pair.count > 0 && robot.links[pair.a].name == "palm" &&
             robot.links[pair.b].name == link;
    });
  };
  CHECK(by_hulls(hand, "index_near"));
  CHECK(hand.left_out.empty());
  // A palm that reaches into the finger touches it in any case.
  urdf.links[0].shapes[0].at.translation().z() += 0.02;
  const RobotHand other = robot_hand(urdf, {}, "mitten").value();
  CHECK_FALSE(by_hulls(other, "index_near"));
  CHECK_FALSE(other.left_out.empty());
}

// A box's capsule reaches its corners and sticks out at its sides; what is round it fits.
TEST_CASE("hulls keep neighbouring fingers apart where capsules touch and the shapes do not") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  Urdf boxes = mitten;
  for (Link& link : boxes.links) {
    for (Shape& shape : link.shapes) {
      if (link.parent < 0 || link.name.starts_with("thumb")) continue;
      const double long_m = shape.size_m.y() + 2.0 * shape.size_m.x();
      shape.kind = Shape::Kind::kBox;
      shape.size_m = Eigen::Vector3d(0.012, 0.013, long_m);
    }
  }
  const auto pair_of = [](const RobotHand& hand, const std::string& a, const std::string& b) {
    const auto at = std::ranges::find_if(hand.pairs, [&](const LinkPair& pair) {
      return hand.links[pair.a].name == a && hand.links[pair.b].name == b;
    });
    REQUIRE(at != hand.pairs.end());
    return *at;
  };
  const RobotHand hand = robot_hand(boxes, {}, "mitten").value();
  const LinkPair near = pair_of(hand, "index_near", "middle_near");
  CHECK(near.count == 1);
  CHECK(pair_of(robot_hand(mitten, {}, "mitten").value(), "index_near", "middle_near").count == 0);
  // When open not even their capsules touch. Leaning to each other they do, and may go on.
  Placed placed(hand);
  Drive drive = hand.start();
  place(hand, drive, placed);
  CHECK(gap_between(hand, placed, near.a, near.b).gap_m > 0.0);
  for (const DrivenJoint& joint : hand.driven) {
    const std::string& name = hand.joints[static_cast<std::size_t>(joint.joint)].name;
    if (name == "index_spread") drive[&joint - hand.driven.data()] = 0.04;
    if (name == "middle_spread") drive[&joint - hand.driven.data()] = -0.04;
  }
  place(hand, drive, placed);
  CHECK(gap_between(hand, placed, near.a, near.b).gap_m < 0.0);
  Gaps gaps;
  CHECK(std::ranges::none_of(find_gaps(hand, placed, {}, false, gaps),
                             [&](const Gap& gap) { return gap.a == near.a && gap.b == near.b; }));
}

TEST_CASE("a follower that can nowhere be within its limits is named") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  Link& last = *std::ranges::find(urdf.links, "thumb_last", &Link::joint);
  last.low = 0.2;  // it is turned the other way
  last.high = 1.4;
  const auto hand = robot_hand(std::move(urdf), {}, "mitten");
  REQUIRE_FALSE(hand);
  CHECK(hand.error().message.find("thumb_last") != std::string::npos);
  CHECK(hand.error().message.find("multiplier") != std::string::npos);
}

TEST_CASE("a finger is as long as it can reach, though its links are not in a row") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const auto link = [&](const char* joint) {
    return std::ranges::find(urdf.links, joint, &Link::joint);
  };
  link("index_bend")->at.translation().x() += 0.03;
  link("index_far")->at.translation().x() += 0.03;
  const RobotHand hand = robot_hand(std::move(urdf), {}, "mitten").value();
  const Finger& index = hand.fingers[1];
  Placed placed(hand.links.size());
  double longest_m = 0.0;
  for (int i = 0; i <= 1000; ++i) {
    Drive drive = hand.start();
    for (int d = 0; d < hand.size(); ++d) {
      drive[d] = hand.driven[d].low + (hand.driven[d].high - hand.driven[d].low) * i / 1000.0;
    }
    place(hand, drive, placed);
    longest_m = std::max(longest_m, (placed.at_m[index.tip] - placed.at_m[index.knuckle]).norm());
  }
  // These poses move all joints together, so that a little may be missing.
  CHECK(index.length_m >= longest_m - 1e-6);
  CHECK(index.length_m <= longest_m + 1e-3);
}

TEST_CASE("capsules hold all boxes of a link") {
  auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  // A motor, its horn and four plates of a frame [edges, middle; mm].
  const std::vector<std::array<double, 6>> boxes{{34, 22, 26, 0, 0, 0},  {20, 24, 8, 0, 0, 14},
                                                 {14, 20, 4, 6, 0, 15},  {14, 20, 4, 6, 0, -15},
                                                 {20, 4, 30, 12, 12, 0}, {20, 4, 30, 12, -12, 0}};
  std::vector<Shape>& shapes = urdf.links[0].shapes;
  shapes.clear();
  for (const auto& box : boxes) {
    Shape& shape = shapes.emplace_back();
    shape.size_m = 1e-3 * Eigen::Vector3d(box[0], box[1], box[2]);
    shape.at.translation() = 1e-3 * Eigen::Vector3d(box[3], box[4], box[5] - 60.0);
  }
  const std::vector<Shape> all = shapes;
  const RobotHand hand = robot_hand(std::move(urdf), {}, "mitten").value();
  int outside = 0, points = 0;
  double farthest_m = 0.0;
  for (const Shape& box : all) {
    for (int n = 0; n < 125; ++n) {  // over the box, its corners too
      const Eigen::Vector3d share(n % 5 / 4.0 - 0.5, n / 5 % 5 / 4.0 - 0.5, n / 25 / 4.0 - 0.5);
      const Eigen::Vector3d point = box.at * share.cwiseProduct(box.size_m);
      bool inside = false;
      for (const Capsule& one : hand.capsules) {
        const Eigen::Vector3d along = one.to_m - one.from_m;
        const double t = std::clamp(
            (point - one.from_m).dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
        const double away_m = (point - one.from_m - t * along).norm();
        inside = inside || (one.link == 0 && away_m <= one.radius_m + 1e-9);
      }
      outside += inside ? 0 : 1;
      ++points;
    }
  }
  for (const Capsule& one : hand.capsules) {
    if (one.link == 0) farthest_m = std::max(farthest_m, one.radius_m);
  }
  CHECK(outside == 0);
  CHECK(points == 750);
  CHECK(farthest_m < 0.022);
}

TEST_CASE("the <hull> of a text is a radius and corners, or refused") {
  const auto said = [](const std::string& hull) {
    const auto urdf = parse_urdf(
        "<robot name=\"r\"><link name=\"a\"><collision><geometry><sphere radius=\"0.01\"/>" + hull +
            "</geometry></collision></link></robot>",
        "r.urdf");
    return urdf ? std::to_string(urdf->links[0].shapes[0].hull.corners.size())
                : urdf.error().message;
  };
  const auto hull = [](const std::string& radius, const std::string& corners) {
    return "<hull radius=\"" + radius + "\" corners=\"" + corners + "\"/>";
  };
  std::string many;
  for (std::size_t k = 0; k < kMaxHullCorners; ++k) many += "0 0 0.1 ";
  CHECK(said("") == "0");
  CHECK(said(hull("0.001", "0 0 0.1  0.2 0 -1e-3 ")) == "2");
  CHECK(said(hull("0", many)) == "64");
  for (const std::string& bad :
       {hull("0", many + "0 0 0.1"), hull("0", ""), hull("0", "0 0"), hull("0", "0 0 nan"),
        hull("0", "0 0 11"), hull("0", "0 0 0.1 x"), hull("-1", "0 0 0.1"), hull("", "0 0 0.1"),
        hull("nan", "0 0 0.1"), std::string("<hull/>")}) {
    INFO(bad.substr(0, 80));
    CHECK(said(bad).find("the <hull> of link 'a' is not") != std::string::npos);
  }
}

// Two boxes one of which is moved through the other: where they overlap by less than they were
// rounded off the gap is exact, and below that they have at least a direction.
TEST_CASE("hulls that overlap have a gap below zero, and a direction however deep") {
  const auto box = [] {
    Hull hull;
    for (int k = 0; k < 8; ++k) {
      hull.corners.emplace_back(0.02 *
                                Eigen::Vector3d((k & 1) - 0.5, (k >> 1 & 1) - 0.5, (k >> 2) - 0.5));
    }
    return hull;
  };
  Hull one = box(), other = box();
  round_off(one);
  round_off(other);
  const Eigen::Matrix3d still = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  double before_m = 1.0;
  for (double at = 0.025; at >= -1e-9; at -= 0.0001) {
    INFO(at);
    const Eigen::Vector3d at_m(at, 0.0, 0.0);
    const Nearest found =
        hull_gap({one, still, at_m}, {other, still, zero}, Eigen::Vector3d::UnitX(), 1e9);
    REQUIRE(std::isfinite(found.gap_m));
    CHECK(found.gap_m <= before_m + 1e-9);
    CHECK(found.apart.norm() == Approx(1.0));
    if (at > 0.0195) CHECK(found.apart.x() == Approx(1.0).margin(1e-3));
    if (at > 0.0195) CHECK(found.gap_m == Approx(at - 0.02).margin(7e-4));
    if (at < 0.0180) CHECK(found.gap_m == Approx(-one.radius_m - other.radius_m));
    before_m = found.gap_m;
  }
}

TEST_CASE("a hull of very many corners holds all and sticks out little") {
  const auto ball = ball_of(20000);
  const Hull hull = hull_of(ball);
  CHECK(hull.radius_m < 1.5e-3);
  const Eigen::Matrix3d still = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  for (const auto& corner : ball) {
    const Hull one{.corners = {corner}};
    REQUIRE(hull_gap({one, still, zero}, {hull, still, zero}, {1.0, 0.0, 0.0}, 1e9).gap_m <= 1e-9);
  }
}

namespace {

// A box of 20 x 20 x 30 mm as a file: two triangles a side are not needed, each corner is there.
std::vector<Eigen::Vector3f> box_corners() {
  std::vector<Eigen::Vector3f> corners;
  for (const int k : {0, 1, 2, 3, 4, 5, 6, 7, 0}) {
    const float x = (k & 1) != 0 ? 0.01f : -0.01f, y = (k & 2) != 0 ? 0.01f : -0.01f;
    corners.emplace_back(x, y, (k & 4) != 0 ? 0.03f : 0.0f);
  }
  return corners;
}

std::string stl_bytes() {
  const auto corners = box_corners();
  std::string bytes = "solid of a maker whose binary files begin so";
  bytes.resize(80, ' ');
  const auto add = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  add(std::uint32_t{3});
  for (std::size_t t = 0; t < 3; ++t) {
    for (int k = 0; k < 3; ++k) add(0.0f);
    for (std::size_t k = 0; k < 3; ++k) {
      for (const float value : corners[3 * t + k]) add(value);
    }
    add(std::uint16_t{0});
  }
  return bytes;
}

std::string corner_lines(const std::string& word) {
  std::string lines = "solid\n";
  for (const auto& corner : box_corners()) {
    lines += "\t " + word;
    for (const float value : corner) lines += "  " + std::to_string(value);
    lines += "\r\n";
  }
  return lines;
}

void write(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace

TEST_CASE("meshes are found as packages lay them out, and one that is not used says why") {
  const test::TempFolder folder;
  const std::filesystem::path package = folder.path() / "hands" / "package";
  write(package / "meshes/box.stl", stl_bytes());
  write(package / "meshes/text.STL", corner_lines("vertex"));
  write(package / "meshes/box.obj", corner_lines("v"));
  write(package / "meshes/pointer.stl", "version https://git-lfs.github.com/spec/v1\noid x\n");
  write(package / "meshes/cut.stl", stl_bytes().substr(0, 100));
  write(package / "meshes/box.dae", "<COLLADA/>");
  write(folder.path() / "far.stl", stl_bytes());
  const auto load = [&](const std::string& mesh, const std::string& words = "collision") {
    const auto path = package / "urdf/r.urdf";
    write(path, "<robot name=\"r\"><link name=\"a\"><" + words + "><geometry><mesh filename=\"" +
                    mesh + "/></geometry></" + words + "></link></robot>");
    return parse_urdf(load_urdf(path.string()).value(), "r.urdf").value();
  };
  for (const std::string& mesh :
       {std::string("../meshes/box.stl\""), std::string("../meshes/text.STL\""),
        std::string("package://hand_description/meshes/box.obj\""),
        std::string("package://hand_description/meshes/box.stl\" scale=\"1 -1 1\""),
        "file://" + (package / "meshes/box.stl").string() + "\""}) {
    INFO(mesh);
    const Urdf urdf = load(mesh);
    REQUIRE(urdf.links[0].shapes.size() == 1);
    const Shape& shape = urdf.links[0].shapes[0];
    CHECK(shape.hull.corners.size() == 8);
    const Eigen::Vector3d far = shape.at.inverse() * Eigen::Vector3d(0.01, 0.01, 0.03);
    CHECK(std::ranges::any_of(shape.hull.corners, [&](const Eigen::Vector3d& corner) {
      return (corner - far).norm() < 1e-5;
    }));
    CHECK_FALSE(urdf.by_visuals);
  }
  CHECK(load("../meshes/box.stl\"", "visual").by_visuals);
  CHECK(load("../meshes/box.stl\"", "visual").links[0].shapes.size() == 1);
  const std::vector<std::pair<std::string, std::string>> unused{
      {"../meshes/pointer.stl\"", "git lfs pull"},
      {"../meshes/box.dae\"", "posed reads .stl and .obj"},
      {"../meshes/cut.stl\"", "no mesh"},
      {"../meshes/box.stl\" scale=\"1 nan 1\"", "scale"},
      {"../meshes/box.stl\" scale=\"0.001\"", "scale"},
      {"../meshes/box.stl\" scale=\"1000 1000 1000\"", "larger than 1 m"},
      {"../meshes/none.stl\"", "not where the URDF names them"},
      {"../../../far.stl\"", "not where the URDF names them"},
      {"file:///etc/hosts.stl\"", "not where the URDF names them"},
      {"../meshes\"", "posed reads"}};
  for (const auto& [mesh, why] : unused) {
    INFO(mesh);
    const Urdf urdf = load(mesh);
    REQUIRE(urdf.links[0].unused_meshes.size() == 1);
    CHECK(urdf.links[0].unused_meshes[0].find(why) != std::string::npos);
  }
}

TEST_CASE("a finger without a tip ends where its shapes do, and what is beside it is no tip") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const RobotHand before = robot_hand(mitten, {}, "mitten").value();
  Urdf bare = mitten, sensors = mitten;
  for (Link& link : bare.links) {
    if (link.name.ends_with("_tip")) link.at.translation().setZero();
  }
  const RobotHand hand = robot_hand(bare, {}, "mitten").value();
  for (std::size_t f = 0; f < hand.fingers.size(); ++f) {
    INFO(f);
    CHECK(hand.fingers[f].tip_known);
    CHECK(hand.fingers[f].tip == hand.fingers[f].last);
    CHECK(hand.fingers[f].length_m == Approx(before.fingers[f].length_m).margin(4e-3));
  }
  for (Link& link : bare.links) link.shapes.clear();
  CHECK_FALSE(robot_hand(bare, {}, "mitten").value().fingers[1].tip_known);
  Link sensor = sensors.links[static_cast<std::size_t>(before.fingers[1].tip)];
  sensor.name = sensor.joint = "camera";
  sensor.at.translation() = Eigen::Vector3d(0.06, 0.0, 0.0);
  sensors.links.push_back(sensor);
  const RobotHand seeing = robot_hand(sensors, {}, "mitten").value();
  CHECK(seeing.links[seeing.fingers[1].tip].name == "index_tip");
}

TEST_CASE("which finger is which and which side it is are not told by one sign alone") {
  const auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  const auto link = [](Urdf& urdf, const char* joint) {
    return std::ranges::find(urdf.links, joint, &Link::joint);
  };
  // A thumb that is mounted behind the ring finger: names tell.
  Urdf behind = mitten;
  link(behind, "thumb_turn")->at.translation() = Eigen::Vector3d(0.02, -0.03, -0.07);
  link(behind, "thumb_turn")->at.linear().setIdentity();
  const RobotHand hand = robot_hand(behind, {}, "mitten").value();
  CHECK(hand.links[hand.fingers[1].tip].name == "index_tip");
  CHECK(hand.side == Side::kRight);
  // Joints that turn to both sides as far: the thumb's place tells, here of a mirror image.
  Urdf left = mitten;
  for (Link& one : left.links) {
    const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
    one.at.translation() = mirror.cwiseProduct(one.at.translation());
    one.at.linear() = mirror.asDiagonal() * one.at.linear() * mirror.asDiagonal();
    one.axis = -mirror.cwiseProduct(one.axis);
    if (one.turns && one.leader < 0) one.high = -(one.low = -1.5);
    one.shapes.clear();
  }
  for (Link& one : left.links) one.leader = -1;
  CHECK(robot_hand(left, {}, "mitten").value().side == Side::kLeft);
}

TEST_CASE("what slides or floats above the palm stands, and in a finger it is refused") {
  auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  std::ranges::find(mitten.links, "index_spread", &Link::joint)->turns = false;
  std::ranges::find(mitten.links, "index_spread", &Link::joint)->slides = true;
  const auto refused = robot_hand(mitten, {}, "mitten");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.find("of a finger slides") != std::string::npos);
  std::string text = load_urdf(test::mitten()).value();
  // A rod that is moved by a cylinder in the palm.
  const std::string rod =
      with(with(text, "</robot>",
                "<link name=\"rod\"/><joint name=\"cylinder\" type=\"prismatic\"><parent "
                "link=\"palm\"/><child link=\"rod\"/></joint></robot>"),
           "<joint name=\"index_flex\" type=\"revolute\">",
           "<joint name=\"index_flex\" type=\"revolute\"><mimic joint=\"cylinder\"/>");
  const auto moved = robot_hand(parse_urdf(rod, "mitten").value(), {}, "mitten");
  REQUIRE_FALSE(moved);
  CHECK(moved.error().message.find("follows one that does") != std::string::npos);
  text = with(text, "<link name=\"palm\">",
              "<link name=\"world\"/><joint name=\"free\" type=\"floating\"><parent "
              "link=\"world\"/><child link=\"palm\"/></joint><link name=\"palm\">");
  const RobotHand hand = robot_hand(parse_urdf(text, "mitten").value(), {}, "mitten").value();
  CHECK(hand.size() == 15);
}

TEST_CASE("a URDF that is not in metres is refused with the units it may be in") {
  const auto said = [](double unit) {
    auto urdf = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
    for (Link& link : urdf.links) {
      link.at.translation() *= unit;
      link.shapes.clear();
    }
    const auto refused = robot_hand(urdf, {}, "mitten");
    return refused ? std::string() : refused.error().message;
  };
  CHECK(said(1.0).empty());
  CHECK(said(1000.0).find("in millimetres: a URDF is in metres") != std::string::npos);
  CHECK(said(100.0).find("in inches or centimetres: ") != std::string::npos);
}

TEST_CASE("a URDF without speeds can be looked at, and needs them to be driven") {
  auto mitten = parse_urdf(load_urdf(test::mitten()).value(), "mitten").value();
  for (Link& link : mitten.links) link.speed = 0.0;
  const auto driven = robot_hand(mitten, {}, "mitten");
  REQUIRE_FALSE(driven);
  CHECK(driven.error().message.find("no velocity limit") != std::string::npos);
  CHECK(robot_hand(mitten, {.needs_speeds = false}, "mitten").value().joints[0].speed == 0.0);
  CHECK(robot_hand(mitten, {.speed = 3.0}, "mitten").value().joints[0].speed == 3.0);
  for (Link& link : mitten.links) link.speed = 2.0;  // the smaller wins, whoever said it
  CHECK(robot_hand(mitten, {.speed = 3.0}, "mitten").value().driven[0].speed == 2.0);
  CHECK(robot_hand(mitten, {.speed = 1.0}, "mitten").value().driven[0].speed == 1.0);
}

TEST_CASE("real hands are read as their makers made them") {
  const auto folder = test::shared("data/robots");
  if (!folder) SKIP_WITHOUT_SHARED();
  for (const std::string name : {"allegro", "shadow", "ability"}) {
    for (const std::string side : {"left", "right"}) {
      INFO(name << " " << side);
      const auto path = (*folder / (name + "_hand") / (name + "_hand_" + side + ".urdf")).string();
      auto urdf = parse_urdf(load_urdf(path).value(), path).value();
      const RobotHand hand = robot_hand(std::move(urdf), {}, path).value();
      CHECK(hand.side == (side == "left" ? Side::kLeft : Side::kRight));
      CHECK(hand.fingers.size() == (name == "allegro" || name == "leap" ? 4 : 5));
      // All hands but Shadow's and Schunk's have x out of the palm and z to the fingers.
      CHECK(hand.palm(0, 0) > 0.95);
      CHECK(hand.palm(2, 2) > 0.95);
    }
  }
}

}  // namespace posed::robot
