#include <map>
#include <random>

#include <catch2/catch.hpp>

#include "proto/frame/rotation.hpp"
#include "tests/support/seeds.hpp"
#include "tests/unit/proto/rig/maker.hpp"

namespace posed {
namespace {

using rig::Mat;
using rig::Vec;
using test::ZeroPose;

int below(std::mt19937& random, unsigned limit) { return static_cast<int>(random() % limit); }

Mat yaw(double deg) { return Eigen::AngleAxisd(deg * kDegree, rig::kY).toRotationMatrix(); }

double worst_deg(const rig::Rig& rig, const test::Made& made) {
  double worst = 0.0;
  for (std::size_t j = 0; j < made.T.size(); ++j) {
    const Eigen::Quaterniond truth(made.T[j]);
    worst = std::max(worst, angle_between_rad(rig.T[j], truth) / kDegree);
  }
  return worst;
}

void check_made(const test::Made& made, UpAxis up, double metres_per_unit) {
  const rig::Rig rig = rig::recognise(made.input);
  CHECK(rig.kind == rig::Kind::kPerson);
  const std::size_t bones = made.bone.empty() ? test::kMakerJoints : made.bone.size();
  for (std::size_t j = 0; j < bones; ++j) {
    INFO(made.input.joints[j].name);
    CHECK(rig.bone[j] == (made.bone.empty() ? static_cast<Bone>(j) : made.bone[j]));
  }
  CHECK(worst_deg(rig, made) < 1.0);
  CHECK(up_text(rig.up) == up_text(up));
  CHECK(rig.metres_per_unit == Approx(metres_per_unit));
}

// The same figure with the legs before the trunk, as some makers write it.
test::Made legs_first(const test::Made& made) {
  test::Made out;
  out.input.poses.count = made.input.poses.count;
  std::vector<int> from{0};
  for (int b = 14; b < test::kMakerJoints; ++b) from.push_back(b);
  for (int b = 1; b < 14; ++b) from.push_back(b);
  for (const int b : from) {
    out.bone.push_back(static_cast<Bone>(b));
    out.T.push_back(made.T[b]);
    rig::RigJoint joint = made.input.joints[b];
    const auto parent = std::ranges::find(from, joint.parent);
    if (joint.parent >= 0) joint.parent = static_cast<int>(parent - from.begin());
    out.input.joints.push_back(std::move(joint));
  }
  for (int i = 0; i < made.input.poses.count; ++i) {
    for (const int b : from) {
      const std::size_t at = static_cast<std::size_t>(i) * test::kMakerJoints + b;
      out.input.poses.rotation.push_back(made.input.poses.rotation[at]);
      out.input.poses.position.push_back(made.input.poses.position[at]);
    }
  }
  return out;
}

// The same figure with the legs on the spine, as 3ds Max's Biped may have them.
test::Made legs_on_spine(test::Made made) {
  const int spine = static_cast<int>(Bone::kSpine);
  auto& joints = made.input.joints;
  for (const Bone bone : {Bone::kLeftUpperLeg, Bone::kRightUpperLeg}) {
    auto& thigh = joints[static_cast<std::size_t>(bone)];
    thigh.parent = spine;
    thigh.offset -= joints[spine].offset;
    for (int i = 0; i < made.input.poses.count; ++i) {
      made.input.poses.position[i * joints.size() + static_cast<std::size_t>(bone)] = thigh.offset;
    }
  }
  return made;
}

// A turn of axes onto axes.
Mat axis_turn(std::mt19937& random) {
  const Vec to = rig::kAxes[random() % rig::kAxes.size()];
  return rig::frame(rig::kX, to, rig::kZ, rig::axes_across(to)[random() % 4]);
}

// Any local axis along the bones, and any of the four across it.
test::BoneAxes some_axes(std::mt19937& random) {
  const Vec along = rig::kAxes[random() % rig::kAxes.size()];
  return {.along = along, .lateral = rig::axes_across(along)[random() % 4]};
}

// Joints that never turn, behind those that are there.
void add_joints(test::Made& made, const std::vector<rig::RigJoint>& more) {
  const auto joints = static_cast<std::ptrdiff_t>(made.input.joints.size());
  auto& poses = made.input.poses;
  for (std::ptrdiff_t i = poses.count; i > 0; --i) {
    poses.rotation.insert(poses.rotation.begin() + i * joints, more.size(),
                          Eigen::Quaterniond::Identity());
    for (auto joint = more.rbegin(); joint != more.rend(); ++joint) {
      poses.position.insert(poses.position.begin() + i * joints, joint->offset);
    }
  }
  made.input.joints.insert(made.input.joints.end(), more.begin(), more.end());
}

// Fingers in other languages, which no table has, or without a name. Each hand has a thumb that
// begins at the wrist and four fingers in a row; `size` is a factor of its lengths.
constexpr std::array<std::array<const char*, kFingers>, 4> kForeignFingers{
    {{"Pouce", "Index", "Majeur", "Annulaire", "Auriculaire"},
     {"Daumen", "Zeigefinger", "Mittelfinger", "Ringfinger", "KleinerFinger"},
     {"拇指", "食指", "中指", "无名指", "小指"},
     {"Node", "Node", "Node", "Node", "Node"}}};

test::Made with_fingers(test::Made made, const test::Scheme& scheme,
                        const std::array<const char*, kFingers>& names, double metres_per_unit,
                        double size) {
  if (made.bone.empty()) {
    for (int b = 0; b < test::kMakerJoints; ++b) made.bone.push_back(static_cast<Bone>(b));
  }
  // The first joint of a finger from the wrist, and the second from that, of a left hand [m].
  const std::array<std::array<Vec, 2>, kFingers> places{
      {{Vec(.02, -.005, .03), Vec(.03, -.005, .025)},
       {Vec(.09, 0, .03), Vec(.042, 0, 0)},
       {Vec(.092, 0, .008), Vec(.045, 0, 0)},
       {Vec(.088, 0, -.014), Vec(.042, 0, 0)},
       {Vec(.08, 0, -.034), Vec(.034, 0, 0)}}};
  const std::string_view hand_name = scheme.names[9];
  const std::string maker(hand_name.substr(0, hand_name.find('*')));
  std::vector<rig::RigJoint> more;
  for (const Side side : rig::kSides) {
    const auto hand = std::ranges::find(made.bone, rig::on(side, Bone::kLeftHand));
    const auto at = static_cast<int>(hand - made.bone.begin());
    const Mat T = made.T[at];
    const Vec mirror(side == Side::kLeft ? size : -size, size, size);
    for (const int f : {3, 0, 4, 1, 2}) {  // in no order
      int parent = at;
      for (int i = 0; i < kFingerJoints; ++i) {
        const Vec way = places[f][i == 0 ? 0 : 1].cwiseProduct(mirror) * (i == 2 ? 0.7 : 1.0);
        const std::string number =
            names[0] == names[1] ? std::to_string(more.size() + 1) : std::to_string(i + 1);
        more.push_back(
            {.name = maker + scheme.sides[side == Side::kLeft ? 0 : 1] + '_' + names[f] + number,
             .parent = parent,
             .offset = T.transpose() * way / metres_per_unit,
             .end_site = {}});
        parent = static_cast<int>(made.input.joints.size() + more.size()) - 1;
      }
    }
  }
  const std::array<int, kFingers> order{3, 0, 4, 1, 2};
  for (const Side side : rig::kSides) {
    for (const int f : order) {
      for (int i = 0; i < kFingerJoints; ++i) {
        const int first = static_cast<int>(Bone::kLeftThumbMetacarpal) + kFingerJoints * f;
        made.bone.push_back(rig::on(side, static_cast<Bone>(first + i)));
      }
    }
  }
  add_joints(made, more);
  return made;
}

// The same figure with a stick of three joints in its right hand.
test::Made with_stick(test::Made made) {
  const auto at = std::ranges::find(made.bone, Bone::kRightHand);
  int parent = made.bone.empty() ? static_cast<int>(Bone::kRightHand)
                                 : static_cast<int>(at - made.bone.begin());
  const Vec step = made.input.joints[parent].offset;
  std::vector<rig::RigJoint> stick;
  for (const char* name : {"Item1", "Item2", "Item3"}) {
    stick.push_back({.name = name, .parent = parent, .offset = step, .end_site = {}});
    parent = static_cast<int>(made.input.joints.size() + stick.size()) - 1;
  }
  add_joints(made, stick);
  return made;
}

// A joint of a figure in T-pose that stands on the ground and faces +z.
struct Placed {
  const char* name;
  int parent;
  Vec place;  // in the world
};

rig::Rig recognise(const std::vector<Placed>& joints) {
  rig::RigInput input;
  for (const auto& [name, parent, place] : joints) {
    const Vec above = parent < 0 ? Vec(Vec::Zero()) : joints[parent].place;
    input.joints.push_back(
        {.name = name, .parent = parent, .offset = place - above, .end_site = {}});
  }
  return rig::recognise(input);
}

bool has_note(const rig::Rig& rig, std::string_view part) {
  return std::ranges::any_of(rig.notes,
                             [part](const std::string& note) { return note.contains(part); });
}

std::string joint_of(const rig::Rig& rig, const std::vector<Placed>& joints, Bone bone) {
  const auto at = std::ranges::find(rig.bone, bone);
  return at == rig.bone.end() ? "" : joints[static_cast<std::size_t>(at - rig.bone.begin())].name;
}

}  // namespace

TEST_CASE("rig: where the arms begin at the neck, it is the neck, and the nose is a head") {
  const std::vector<Placed> joints{
      {"MidHip", -1, {0, .95, 0}},       {"Neck", 0, {0, 1.42, 0}},
      {"Nose", 1, {0, 1.6, .08}},        {"REye", 2, {-.03, 1.63, .06}},
      {"REar", 3, {-.08, 1.61, 0}},      {"LEye", 2, {.03, 1.63, .06}},
      {"LEar", 5, {.08, 1.61, 0}},       {"RShoulder", 1, {-.17, 1.42, 0}},
      {"RElbow", 7, {-.45, 1.42, 0}},    {"RWrist", 8, {-.7, 1.42, 0}},
      {"LShoulder", 1, {.17, 1.42, 0}},  {"LElbow", 10, {.45, 1.42, 0}},
      {"LWrist", 11, {.7, 1.42, 0}},     {"RHip", 0, {-.09, .95, 0}},
      {"RKnee", 13, {-.09, .49, 0}},     {"RAnkle", 14, {-.09, .09, 0}},
      {"RBigToe", 15, {-.08, .01, .16}}, {"LHip", 0, {.09, .95, 0}},
      {"LKnee", 17, {.09, .49, 0}},      {"LAnkle", 18, {.09, .09, 0}},
      {"LBigToe", 19, {.08, .01, .16}}};
  const rig::Rig rig = recognise(joints);
  CHECK(rig.kind == rig::Kind::kPerson);
  CHECK(joint_of(rig, joints, Bone::kNeck) == "Neck");
  CHECK(joint_of(rig, joints, Bone::kHead) == "Nose");
  CHECK(joint_of(rig, joints, Bone::kSpine).empty());
  CHECK(joint_of(rig, joints, Bone::kLeftUpperArm) == "LShoulder");
}

// Also a prefix that is an anatomical word, and a shoulder that no word names.
TEST_CASE("rig: a foot below an ankle is the ball, and the toe below it the tip") {
  const std::vector<Placed> joints{
      {"Body_Pelvis", -1, {0, .95, 0}},         {"Body_Torso", 0, {0, 1.2, 0}},
      {"Body_Neck", 1, {0, 1.45, 0}},           {"Body_Head", 2, {0, 1.55, 0}},
      {"Body_ThoraxLeft", 1, {.05, 1.4, 0}},    {"Body_ShoulderLeft", 4, {.17, 1.42, 0}},
      {"Body_ElbowLeft", 5, {.45, 1.42, 0}},    {"Body_WristLeft", 6, {.7, 1.42, 0}},
      {"Body_ThoraxRight", 1, {-.05, 1.4, 0}},  {"Body_ShoulderRight", 8, {-.17, 1.42, 0}},
      {"Body_ElbowRight", 9, {-.45, 1.42, 0}},  {"Body_WristRight", 10, {-.7, 1.42, 0}},
      {"Body_HipLeft", 0, {.09, .9, 0}},        {"Body_KneeLeft", 12, {.09, .49, 0}},
      {"Body_AnkleLeft", 13, {.09, .09, 0}},    {"Body_FootLeft", 14, {.09, .02, .12}},
      {"Body_ToeLeft", 15, {.09, .02, .23}},    {"Body_HipRight", 0, {-.09, .9, 0}},
      {"Body_KneeRight", 17, {-.09, .49, 0}},   {"Body_AnkleRight", 18, {-.09, .09, 0}},
      {"Body_FootRight", 19, {-.09, .02, .12}}, {"Body_ToeRight", 20, {-.09, .02, .23}}};
  const rig::Rig rig = recognise(joints);
  CHECK(joint_of(rig, joints, Bone::kLeftFoot) == "Body_AnkleLeft");
  CHECK(joint_of(rig, joints, Bone::kLeftToes) == "Body_FootLeft");
  CHECK(joint_of(rig, joints, Bone::kRightToes) == "Body_FootRight");
  CHECK(joint_of(rig, joints, Bone::kLeftShoulder) == "Body_ThoraxLeft");
  CHECK(joint_of(rig, joints, Bone::kNeck) == "Body_Neck");
  CHECK(joint_of(rig, joints, Bone::kHead) == "Body_Head");
}

TEST_CASE("rig: soles are flat below legs that stand apart, unless they were laid along them") {
  for (const bool flat : {true, false}) {
    for (const double toes_out_deg : {0.0, 6.0}) {
      auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
      made.input.poses = {};
      auto& joints = made.input.joints;
      const auto leg = [&](Bone of_left, double side) {
        const auto first = static_cast<std::size_t>(of_left);
        const Mat apart = Eigen::AngleAxisd(side * 20 * kDegree, rig::kZ).toRotationMatrix();
        const Mat foot = (flat ? Mat(Mat::Identity()) : apart) * yaw(side * toes_out_deg);
        for (const std::size_t j : {first + 1, first + 2}) {
          joints[j].offset = apart * joints[j].offset;
        }
        joints[first + 3].offset = foot * joints[first + 3].offset;
        joints[first + 3].end_site = foot * Vec(0, 0, 7);
        for (const std::size_t j : {first, first + 1}) made.T[j] = apart.transpose();
        for (const std::size_t j : {first + 2, first + 3}) {
          made.T[j] = flat ? Mat(Mat::Identity()) : Mat(apart.transpose());
        }
      };
      leg(Bone::kLeftUpperLeg, 1.0);
      leg(Bone::kRightUpperLeg, -1.0);
      INFO((flat ? "flat, " : "along the shin, ") << toes_out_deg);
      CHECK(worst_deg(rig::recognise(made.input), made) < 1.0);
    }
  }
}

TEST_CASE("rig: arms that a stance holds unlike are laid level each, without fingers") {
  for (const auto& [left_deg, right_deg] : {std::pair(0.0, 40.0), {80.0, 40.0}, {20.0, 60.0}}) {
    INFO(left_deg << " and " << right_deg);
    auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
    made.input.poses = {};
    const auto lower = [&](Bone upper_arm, double deg) {
      const Mat down = Eigen::AngleAxisd(deg * kDegree, rig::kZ).toRotationMatrix();
      const auto first = static_cast<std::size_t>(upper_arm);
      for (std::size_t j = first; j < first + 3; ++j) {
        rig::RigJoint& joint = made.input.joints[j];
        if (j > first) joint.offset = down * joint.offset;
        if (joint.end_site) joint.end_site = down * *joint.end_site;
        made.T[j] = down.transpose();
      }
    };
    lower(Bone::kLeftUpperArm, -left_deg);
    lower(Bone::kRightUpperArm, right_deg);
    CHECK(worst_deg(rig::recognise(made.input), made) < 1.0);
  }
}

TEST_CASE("rig: the unit of MikuMikuDance's figures is 8 cm") {
  auto made = test::make(test::kSchemes[9], ZeroPose::kA, Mat::Identity(), 0.08);
  made.input.poses = {};
  made.input.joints[0].name = "センター";
  CHECK(rig::recognise(made.input).metres_per_unit == Approx(0.08));
}

TEST_CASE("rig: Poser's unit is for Poser's names: others' short legs are a child's in metres") {
  const auto unit_of = [](std::size_t scheme, double metres_per_unit, double height) {
    auto made = test::make(test::kSchemes[scheme], ZeroPose::kT, Mat::Identity(), metres_per_unit,
                           0, 1, {.height = height, .axes = {}});
    made.input.poses = {};
    return rig::recognise(made.input).metres_per_unit;
  };
  CHECK(unit_of(3, 1.0, 0.45) == Approx(1.0));
  CHECK(unit_of(2, 2.4384, 1.0) == Approx(2.4384));  // "lShldr"
  CHECK(unit_of(2, 1.0, 0.55) == Approx(1.0));       // a child, for others write such names too
}

TEST_CASE("rig: who lies along z in a clip of y up has no floor across z, and is not stood up") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01, 0, 1);
  auto& poses = made.input.poses;
  poses.rotation[0] = Eigen::AngleAxisd(85 * kDegree, rig::kX);
  poses.position[0] = Vec(0, 40, 0);
  const rig::Rig lies = rig::recognise(made.input);
  CHECK(lies.up == UpAxis::kPlusY);
  CHECK(has_note(lies, "if the person stands there, say so (up)"));
  poses.position[0] = Vec::Zero();  // of one who stands in place, the clip shows no floor
  CHECK(has_note(rig::recognise(made.input), "if the person stands there, say so (up)"));
  poses.position[0] = Vec(0, 40, 90);  // nor is one who stands in a file of z up laid down
  CHECK(rig::recognise(made.input).up == UpAxis::kPlusZ);
}

TEST_CASE("rig: end sites of toes that point aside turn no leg") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  for (const Bone toes : {Bone::kLeftToes, Bone::kRightToes}) {
    made.input.joints[static_cast<std::size_t>(toes)].end_site = Vec(30, 0, 0);
  }
  CHECK(worst_deg(rig::recognise(made.input), made) < 1.0);
  made.input.poses = {};
  for (const double noise : {0.0, 1e-15}) {  // nor where the toes are straight below the ankle
    for (const Bone toes : {Bone::kLeftToes, Bone::kRightToes}) {
      made.input.joints[static_cast<std::size_t>(toes)].offset = Vec(noise, -1, -noise);
    }
    const rig::Rig rig = rig::recognise(made.input);
    for (const Bone leg : {Bone::kLeftUpperLeg, Bone::kRightLowerLeg}) {
      CHECK(std::abs(rig.T[static_cast<std::size_t>(leg)].w()) > 0.9999);
    }
  }
}

TEST_CASE("rig: of hands that are counted the one with fingers is the hand") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  auto& joints = made.input.joints;
  const auto hand = static_cast<int>(Bone::kLeftHand);
  joints[hand].name = "mixamorig:LeftHand2";
  add_joints(made, {{.name = "mixamorig:LeftHand1",
                     .parent = static_cast<int>(Bone::kLeftLowerArm),
                     .offset = joints[hand].offset,
                     .end_site = {}},
                    {.name = "mixamorig:LeftHandIndex1",
                     .parent = hand,
                     .offset = Vec(9, 0, 3),
                     .end_site = {}}});
  CHECK(rig::recognise(made.input).bone[hand] == Bone::kLeftHand);
}

TEST_CASE("rig: of toes that are counted the first is the toes") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  const auto toes = static_cast<std::size_t>(Bone::kLeftToes);
  auto& joints = made.input.joints;
  joints[toes].name = "mixamorig:LeftToe5_1";
  add_joints(made, {{.name = "mixamorig:LeftToe1_1",
                     .parent = static_cast<int>(Bone::kLeftFoot),
                     .offset = 0.9 * joints[toes].offset,
                     .end_site = {}}});
  CHECK(rig::recognise(made.input).bone[test::kMakerJoints] == Bone::kLeftToes);
}

TEST_CASE("rig: a joint called the head of a neck is the head, though two necks are below it") {
  auto made = test::make(test::kSchemes.back(), ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  auto& joints = made.input.joints;
  const int head = static_cast<int>(Bone::kHead);
  auto second = joints[head];
  second.name = "neck_C0_1_jnt";
  second.end_site = {};
  for (auto& joint : joints) joint.parent += joint.parent >= head ? 1 : 0;
  joints.insert(joints.begin() + head, second);
  joints[head + 1].parent = head;
  const auto found = rig::recognise(made.input);
  CHECK(found.bone[head + 1] == Bone::kHead);
  CHECK(found.bone[head - 1] == Bone::kNeck);
}

// Rigify counts "spine" to "spine.006", and glTF has no end sites.
TEST_CASE("rig: a head that is only counted is told from the end of one by how far away it is") {
  for (const bool is_head : {true, false}) {
    auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
    made.input.poses = {};
    auto& joints = made.input.joints;
    const int head = static_cast<int>(Bone::kHead);
    for (int j = 0; j <= head; ++j) joints[j].name = "DEF-spine.00" + std::to_string(j);
    joints[head].end_site = {};
    add_joints(made, {{.name = "DEF-spine.006",
                       .parent = head,
                       .offset = (is_head ? 1.0 : 2.0) * joints[head].offset,
                       .end_site = {}}});
    const auto found = rig::recognise(made.input);
    CHECK(found.bone[is_head ? test::kMakerJoints : head] == Bone::kHead);
    if (!is_head) continue;
    made.input.joints.back().end_site = 0.5 * joints[head].offset;
    CHECK(rig::recognise(made.input).bone[test::kMakerJoints] == Bone::kHead);
  }
}

// Many persons, in each maker's names and zero pose.
TEST_CASE("rig: a person is recognised in every maker's names, zero pose, axes and unit") {
  constexpr std::array kUnits{1.0, 0.1, 0.01, 0.001, 0.0254, 0.3048};
  constexpr std::array kZeros{ZeroPose::kT, ZeroPose::kA, ZeroPose::kArmsDown, ZeroPose::kFolded};
  const auto [first, last] = test::seeds(1);
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    const auto about_one = [&random](double by) {
      return std::uniform_real_distribution(1.0 - by, 1.0 + by)(random);
    };
    const test::Scheme& scheme = test::kSchemes[seed % test::kSchemes.size()];
    const ZeroPose zero = kZeros[(seed / test::kSchemes.size()) % kZeros.size()];
    const double metres = kUnits[random() % kUnits.size()];
    const bool has_own_axes = zero == ZeroPose::kFolded && seed % 2 == 0;
    // A zero pose of any axes may look upright by chance; then only the usual axes are found.
    const UpAxis up = kUpAxes[random() % (has_own_axes ? 2 : kUpAxes.size())];
    // A folded zero pose has bones along its local axes, so it is not turned by odd angles.
    const double turned_deg = zero == ZeroPose::kFolded ? 0.0 : 30.0 * below(random, 12);
    test::Build build{.height = about_one(0.15),
                      .trunk = about_one(0.08),
                      .arms = about_one(0.08),
                      .legs = about_one(0.08),
                      .shoulders = about_one(0.15),
                      .arms_down_deg = 45.0 * about_one(0.6)};
    if (has_own_axes) std::ranges::generate(build.axes, [&] { return some_axes(random); });
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone: " << scheme.names[0]
                 << ", zero pose " << static_cast<int>(zero) << ", " << metres << " m, "
                 << up_text(up) << " up, turned by " << turned_deg << ", height " << build.height);
    const Mat axes = up_turn(up).transpose() * yaw(turned_deg);
    test::Made made = test::make(scheme, zero, axes, metres, 0, 40, build);
    const auto is_called = [&scheme](int bone, std::string_view word) {
      return std::string_view(scheme.names[bone]).find(word) != std::string_view::npos;
    };
    if (seed % 2 == 0) {
      made = legs_first(made);
    } else if (seed % 3 == 0 && is_called(0, "Pelvis") && is_called(1, "Spine")) {
      made = legs_on_spine(std::move(made));
    }
    // A zero pose that shows the person needs no clip.
    if (seed % 3 == 0 && zero != ZeroPose::kFolded) made.input.poses = {};
    if (seed % 4 == 1) {
      made =
          with_fingers(std::move(made), scheme, kForeignFingers[seed / 4 % kForeignFingers.size()],
                       metres, about_one(0.2));
    }
    // Of limbs without a known name the shape alone does not tell a stick among fingers.
    const bool known_by_shape = scheme.names[7] == std::string_view("Oberarm*");
    if (seed % 7 == 0 && !(known_by_shape && seed % 4 == 1)) made = with_stick(std::move(made));
    if (seed % 5 == 0) {
      for (auto& joint : made.input.joints) joint.name = "Actor_1:" + joint.name;
    }
    check_made(made, up, metres);
  }
}

TEST_CASE("rig: who strides stands along any axis; who keeps still may lie") {
  for (const UpAxis up : {UpAxis::kPlusX, UpAxis::kMinusZ}) {
    for (const bool strides : {true, false}) {
      INFO(up_text(up) << (strides ? " strides" : " keeps still"));
      test::Made made = test::make(test::kSchemes[14], ZeroPose::kT, Mat::Identity(), 1.0);
      auto& [count, rotation, position] = made.input.poses;
      const Mat turn = up_turn(up).transpose();
      for (int i = count - 1; i >= 0; --i) {  // the first frame is copied before it turns
        const auto at = static_cast<std::size_t>(i) * test::kMakerJoints;
        if (!strides) std::copy_n(rotation.begin(), test::kMakerJoints, rotation.begin() + at);
        rotation[at] = Eigen::Quaterniond(turn) * rotation[at];
        position[at] = turn * position[strides ? at : 0];
      }
      CHECK(up_text(rig::recognise(made.input).up) == (strides ? up_text(up) : "+y"));
    }
  }
}

TEST_CASE("rig: parts of one clip give the same T frames") {
  for (const ZeroPose zero : {ZeroPose::kA, ZeroPose::kFolded}) {
    const auto whole = test::make(test::kSchemes[0], zero, Mat::Identity(), 0.01, 0, 240);
    const auto expected = rig::recognise(whole.input);
    for (const int first : {0, 60, 120, 180}) {
      const auto part = test::make(test::kSchemes[0], zero, Mat::Identity(), 0.01, first, 60);
      const auto got = rig::recognise(part.input);
      for (std::size_t j = 0; j < got.T.size(); ++j) {
        CHECK(angle_between_rad(got.T[j], expected.T[j]) < 1e-6);
      }
    }
  }
}

TEST_CASE("rig: a live skeleton needs no clip") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kArmsDown, Mat::Identity(), 1.0);
  made.input.poses = {};
  check_made(made, UpAxis::kPlusY, 1.0);
  CHECK(rig::recognise(made.input).notes.empty());
}

TEST_CASE("rig: eyes, tips, twists and zero-length hips are no bones and move no T") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  auto& joints = made.input.joints;
  const int head = static_cast<int>(Bone::kHead);
  const int arm = static_cast<int>(Bone::kLeftUpperArm);
  joints.push_back({.name = "LeftEye", .parent = head, .offset = {3, 2, 9}, .end_site = {}});
  joints.push_back({.name = "Jaw", .parent = head, .offset = {0, -3, 9}, .end_site = {}});
  joints.push_back({.name = "LeftArmTwist", .parent = arm, .offset = {9, 0, 0}, .end_site = {}});
  const rig::Rig rig = rig::recognise(made.input);
  for (int b = 0; b < test::kMakerJoints; ++b) CHECK(rig.bone[b] == static_cast<Bone>(b));
  for (std::size_t j = test::kMakerJoints; j < joints.size(); ++j) {
    CHECK_FALSE(rig.bone[j].has_value());
  }
  CHECK(worst_deg(rig, made) < 1.0);
}

TEST_CASE("rig: fingers are known by their words, by numbers and as anatomists count them") {
  const std::vector<std::array<std::string, 4>> makers{
      {"LeftHandIndex1", "LeftHandIndex2", "LeftHandIndex3", "LeftHandIndex4"},
      {"LeftInHandIndex", "LeftHandIndex1", "LeftHandIndex2", "LeftHandIndex3"},
      {"LeftFinger10", "LeftFinger11", "LeftFinger12", "LeftFinger1Nub"},
      {"LeftSecondMetacarpal", "LeftSecondProximalPhalange", "LeftSecondMiddlePhalange",
       "LeftSecondDistalPhalange"},
      {"LeftIndexBase1", "LeftIndex1", "LeftIndex2", "LeftIndex3"}};
  for (const auto& names : makers) {
    auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
    made.input.poses = {};
    auto& joints = made.input.joints;
    joints.push_back({.name = "LeftFinger0", .parent = 9, .offset = {1, 0, 3}, .end_site = {}});
    int parent = static_cast<int>(Bone::kLeftHand);
    const bool in_palm = names[3] != "LeftHandIndex4" && names[3] != "LeftFinger1Nub";
    double way = in_palm ? 2.0 : 9.0;  // from the wrist
    for (const std::string& name : names) {
      joints.push_back({.name = name, .parent = parent, .offset = {way, 0, 0}, .end_site = {}});
      parent = static_cast<int>(joints.size()) - 1;
      way = 3.0;
    }
    const rig::Rig rig = rig::recognise(made.input);
    for (int i = 0; i < 3; ++i) {
      const std::size_t j = test::kMakerJoints + 1 + i + (in_palm ? 1 : 0);
      INFO(joints[j].name);
      CHECK(rig.bone[j] == static_cast<Bone>(static_cast<int>(Bone::kLeftIndexProximal) + i));
    }
  }
}

TEST_CASE("rig: a tip alone is no finger, and a numbered joint goes on in its finger") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  auto& joints = made.input.joints;
  const int hand = static_cast<int>(Bone::kLeftHand);
  const int other = static_cast<int>(Bone::kRightHand);
  const auto add = [&joints](const char* name, int parent, const Vec& offset) {
    joints.push_back({.name = name, .parent = parent, .offset = offset, .end_site = {}});
    return static_cast<int>(joints.size()) - 1;
  };
  const int tip = add("LEFT_HAND_MIDDLE_4", hand, {18, 0, 0});
  // MakeHuman's thumb is the first finger, but its first joint has a name of its own.
  const int thumb = add("rthumb", other, {-2, -1, 3});
  const int second = add("finger1-2.r", thumb, {-3, 0, 2});
  const int index = add("finger2-1.r", other, {-9, 0, 3});
  add("finger5-1.r", other, {-8, 0, -3});
  const rig::Rig rig = rig::recognise(made.input);
  CHECK_FALSE(rig.bone[tip].has_value());
  CHECK(rig.bone[thumb] == Bone::kRightThumbMetacarpal);
  CHECK(rig.bone[second] == Bone::kRightThumbProximal);
  CHECK(rig.bone[index] == Bone::kRightIndexProximal);
}

TEST_CASE("rig: what helps beside a limb or a finger, or lies at its joint, is not taken for it") {
  struct Added {
    const char* name;
    const char* parent;
    Vec offset;
    std::optional<Bone> bone = {};
  };
  constexpr const char* kHand = "mixamorig:LeftHand";
  const auto check = [](const std::vector<Added>& added) {
    auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
    made.input.poses = {};
    auto& joints = made.input.joints;
    for (const auto& [name, parent, offset, bone] : added) {
      const auto at = std::ranges::find(joints, parent, &rig::RigJoint::name);
      const int above = static_cast<int>(at - joints.begin());
      joints.push_back({.name = name, .parent = above, .offset = offset, .end_site = rig::kX});
    }
    const rig::Rig rig = rig::recognise(made.input);
    for (std::size_t i = 0; i < added.size(); ++i) {
      INFO(added[i].name);
      CHECK(rig.bone[test::kMakerJoints + i] == added[i].bone);
    }
  };
  check({{"LeftFingerIndex0", kHand, {9, 0, 3}, Bone::kLeftIndexProximal},
         {"LeftFingerIndex1", "LeftFingerIndex0", {4, 0, 0}, Bone::kLeftIndexIntermediate},
         {"LeftFingerIndex2", "LeftFingerIndex1", {3, 0, 0}, Bone::kLeftIndexDistal},
         {"LeftFingerIndexAux", kHand, {16, 0, 3}},
         {"LeftFingerIndexSkin", kHand, {12, 0, 3}}});
  check({{"LeftThumb0", kHand, {2, 0, 2}},
         {"LeftThumb1", "LeftThumb0", {1, 0, 1}, Bone::kLeftThumbMetacarpal},
         {"LeftThumb2", "LeftThumb1", {3, 0, 2}, Bone::kLeftThumbProximal},
         {"LeftThumb3", "LeftThumb2", {3, 0, 2}, Bone::kLeftThumbDistal}});
  // A number that counts the joints of one finger does not say which finger it is.
  check({{"LeftKleinerFinger1", kHand, {8, 0, -3}},
         {"LeftKleinerFinger2", "LeftKleinerFinger1", {3, 0, 0}},
         {"LeftKleinerFinger3", "LeftKleinerFinger2", {2, 0, 0}}});
}

TEST_CASE("rig: fingers known by their place are less sure, and those that are not are told") {
  const auto plain = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  auto made = with_fingers(plain, test::kSchemes[0], kForeignFingers[0], 0.01, 1.0);
  const rig::Rig rig = rig::recognise(made.input);
  REQUIRE(rig.notes.size() == 2);
  CHECK(rig.notes[0] == "fingers of the left hand are known by their place only");
  CHECK(rig.evidence.back().sure < 0.8);
  CHECK(rig.evidence[0].sure > 0.8);
  for (std::size_t j = test::kMakerJoints; j < made.input.joints.size(); ++j) {
    if (made.bone[j] == Bone::kLeftThumbMetacarpal) made.input.joints[j].offset = {8.5, 0, -3};
  }
  const rig::Rig odd = rig::recognise(made.input);  // a thumb among the fingers
  REQUIRE(odd.notes.size() == 2);
  CHECK(odd.notes[0].find("neither names nor places say which") != std::string::npos);
  CHECK_FALSE(odd.bone[test::kMakerJoints].has_value());
}

// Second Life's skeleton has four spare joints in the trunk, which lie still.
TEST_CASE("rig: joints by which the trunk comes back to where it was are no bones") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  auto& joints = made.input.joints;
  std::map<std::string, std::optional<Bone>> truth;
  for (std::size_t b = 0; b < joints.size(); ++b) truth[joints[b].name] = static_cast<Bone>(b);
  for (const Bone below : {Bone::kChest, Bone::kSpine}) {
    const auto at = static_cast<int>(below);
    for (auto& joint : joints) joint.parent += joint.parent >= at ? 2 : 0;
    const Vec way = joints[at].offset;
    for (const double back : {-1.0, 1.0}) {
      const std::string name = "Spine" + std::to_string(joints.size());
      joints.insert(
          joints.begin() + at,
          {.name = name, .parent = at - (back > 0 ? 1 : 0), .offset = back * way, .end_site = {}});
      truth[name] = std::nullopt;
    }
    joints[at + 1].parent = at;
    joints[at + 2].parent = at + 1;
  }
  const rig::Rig rig = rig::recognise(made.input);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    INFO(joints[j].name);
    CHECK(rig.bone[j] == truth[joints[j].name]);
    CHECK(std::abs(rig.T[j].w()) > 0.9999);
  }
}

// One sign of three then says that the pelvis is upside down, and who looks along an axis has
// another of its own along that one.
TEST_CASE("rig: hip joints above the hips of a folded zero pose leave the pelvis upright") {
  for (const UpAxis up : {UpAxis::kPlusY, UpAxis::kPlusZ}) {
    auto made = test::make(test::kSchemes[0], ZeroPose::kFolded, up_turn(up).transpose(), 0.01);
    const auto joints = made.input.joints.size();
    for (const Bone bone : {Bone::kLeftUpperLeg, Bone::kRightUpperLeg}) {
      const auto j = static_cast<std::size_t>(bone);
      made.input.joints[j].offset += made.T[0].transpose() * Vec(0, 0.08, 0) / 0.01;
      for (int i = 0; i < made.input.poses.count; ++i) {
        made.input.poses.position[i * joints + j] = made.input.joints[j].offset;
      }
    }
    INFO(up_text(up) << " up");
    check_made(made, up, 0.01);
  }
}

TEST_CASE("rig: of joints at one place the last one of a limb's name is the bone") {
  std::vector<Placed> joints{{"Hips", -1, {0, .95, 0}},   {"Spine_Root", 0, {0, .95, 0}},
                             {"Spine0", 1, {0, 1.05, 0}}, {"Spine1", 2, {0, 1.2, 0}},
                             {"Neck", 3, {0, 1.45, 0}},   {"Head", 4, {0, 1.55, 0}}};
  for (const bool left : {true, false}) {
    const double x = left ? 1.0 : -1.0;
    const auto add = [&](const char* of_left, const char* of_right, int parent, const Vec& place) {
      joints.push_back({left ? of_left : of_right, parent, place.cwiseProduct(Vec(x, 1, 1))});
      return static_cast<int>(joints.size()) - 1;
    };
    int at = add("LeftCollarBase", "RightCollarBase", 3, {0, 1.2, 0});
    at = add("LeftShoulder", "RightShoulder", at, {.03, 1.42, 0});
    at = add("LeftUpperArmBase", "RightUpperArmBase", at, {.17, 1.42, 0});
    at = add("LeftUpperArm", "RightUpperArm", at, {.17, 1.42, 0});
    at = add("LeftLowerArmRoot", "RightLowerArmRoot", at, {.45, 1.42, 0});
    at = add("LeftLowerArm", "RightLowerArm", at, {.45, 1.42, 0});
    add("LeftHand", "RightHand", at, {.7, 1.42, 0});
    at = add("LeftUpperLeg", "RightUpperLeg", 0, {.09, .9, 0});
    at = add("LeftLowerLeg", "RightLowerLeg", at, {.09, .49, 0});
    at = add("LeftFoot", "RightFoot", at, {.09, .09, 0});
    at = add("LeftForeFoot", "RightForeFoot", at, {.09, .05, .07});
    add("LeftToeBase", "RightToeBase", at, {.09, .02, .13});
  }
  const rig::Rig rig = recognise(joints);
  CHECK(joint_of(rig, joints, Bone::kSpine) == "Spine0");
  CHECK(joint_of(rig, joints, Bone::kLeftShoulder) == "LeftShoulder");
  CHECK(joint_of(rig, joints, Bone::kRightUpperArm) == "RightUpperArm");
  CHECK(joint_of(rig, joints, Bone::kLeftLowerArm) == "LeftLowerArm");
  CHECK(joint_of(rig, joints, Bone::kLeftToes) == "LeftToeBase");
}

TEST_CASE("rig: a limb whose joints are only counted is known by its lengths") {
  // A calf's helper has a letter of its own.
  std::vector<Placed> joints{{"kosi", -1, {0, .95, 0}},
                             {"sebo", 0, {0, 1.2, 0}},
                             {"kubi", 1, {0, 1.45, 0}},
                             {"kao", 2, {0, 1.55, 0}}};
  for (const bool left : {true, false}) {
    const double x = left ? 1.0 : -1.0;
    const auto add = [&](const char* of_left, const char* of_right, int parent, const Vec& place) {
      joints.push_back({left ? of_left : of_right, parent, place.cwiseProduct(Vec(x, 1, 1))});
      return static_cast<int>(joints.size()) - 1;
    };
    int at = add("arm_a_l", "arm_a_r", 1, {.17, 1.42, 0});
    at = add("arm_b_l", "arm_b_r", at, {.45, 1.42, 0});
    add("arm_d_l", "arm_d_r", at, {.7, 1.42, 0});
    at = add("asi_a_l", "asi_a_r", 0, {.09, .9, 0});
    at = add("asi_b_l", "asi_b_r", at, {.09, .49, 0});
    at = add("asi_c_l", "asi_c_r", at, {.09, .29, 0});
    at = add("asi_d_l", "asi_d_r", at, {.09, .09, 0});
    add("asi_e_l", "asi_e_r", at, {.09, .02, .13});
  }
  const rig::Rig rig = recognise(joints);
  CHECK(joint_of(rig, joints, Bone::kLeftUpperArm) == "arm_a_l");
  CHECK(joint_of(rig, joints, Bone::kLeftLowerArm) == "arm_b_l");
  CHECK(joint_of(rig, joints, Bone::kRightHand) == "arm_d_r");
  CHECK(joint_of(rig, joints, Bone::kLeftUpperLeg) == "asi_a_l");
  CHECK(joint_of(rig, joints, Bone::kLeftLowerLeg) == "asi_b_l");
  CHECK(joint_of(rig, joints, Bone::kRightFoot) == "asi_d_r");
  CHECK(joint_of(rig, joints, Bone::kRightToes) == "asi_e_r");
}

TEST_CASE("rig: a hand that no name gives a side is told by how its fingers bend, else asked for") {
  for (const double bend_deg : {40.0, -40.0, 0.0}) {
    rig::RigInput input;
    const auto add = [&input](const std::string& name, int parent, const Vec& offset) {
      input.joints.push_back({.name = name, .parent = parent, .offset = offset, .end_site = {}});
      return static_cast<int>(input.joints.size()) - 1;
    };
    add("wrist", -1, Vec::Zero());
    constexpr std::array kNames{"index", "middle", "ring", "little"};
    for (int f = 0; f < 4; ++f) {
      const std::string name = kNames[f];
      const int first = add(name + "1", 0, Vec(9, 0, 3 - 2 * f));
      const int second = add(name + "2", first, Vec(4, 0, 0));
      add(name + "3", second, Vec(3, 0, 0));
    }
    input.poses.count = 1;
    for (const auto& joint : input.joints) {
      const bool bends = joint.name.ends_with('1');
      input.poses.rotation.emplace_back(
          Eigen::AngleAxisd(bends ? -bend_deg * kDegree : 0.0, rig::kZ));
      input.poses.position.push_back(joint.offset);
    }
    const rig::Rig rig = rig::recognise(input);
    CHECK(rig.kind == rig::Kind::kHand);
    CHECK(rig.bone[0] == (bend_deg > 0 ? Bone::kLeftHand : Bone::kRightHand));
    REQUIRE(rig.notes.size() == 1);
    CHECK((rig.notes[0].find("is not known") != std::string::npos) == (bend_deg == 0.0));
  }
}

TEST_CASE("rig: an animal on four legs is no person, whatever its joints are called") {
  const std::vector<Placed> joints{{"Hips", -1, {0, .6, -.3}},
                                   {"LeftUpLeg", 0, {.08, .55, -.3}},
                                   {"LeftLeg", 1, {.08, .3, -.25}},
                                   {"LeftFoot", 2, {.08, .1, -.35}},
                                   {"RightUpLeg", 0, {-.08, .55, -.3}},
                                   {"RightLeg", 4, {-.08, .3, -.25}},
                                   {"RightFoot", 5, {-.08, .1, -.35}},
                                   {"Spine", 0, {0, .62, .1}},
                                   {"Head", 7, {0, .8, .4}},
                                   {"LeftArm", 7, {.08, .5, .15}},
                                   {"LeftForeArm", 9, {.08, .3, .1}},
                                   {"LeftHand", 10, {.08, .1, .1}},
                                   {"RightArm", 7, {-.08, .5, .15}},
                                   {"RightForeArm", 12, {-.08, .3, .1}},
                                   {"RightHand", 13, {-.08, .1, .1}}};
  const rig::Rig rig = recognise(joints);
  CHECK(rig.kind == rig::Kind::kPart);
  CHECK(std::ranges::none_of(rig.bone, [](const auto& bone) { return bone.has_value(); }));
  REQUIRE_FALSE(rig.notes.empty());
  CHECK(rig.notes[0].find("four legs") != std::string::npos);
}

TEST_CASE("rig: of two persons in one tree the first is taken, and that is said") {
  const auto one = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  rig::RigInput both;
  both.joints.push_back({.name = "Scene", .parent = -1, .offset = Vec::Zero(), .end_site = {}});
  for (int person = 0; person < 2; ++person) {
    const int first = static_cast<int>(both.joints.size());
    for (auto joint : one.input.joints) {
      joint.parent = joint.parent < 0 ? 0 : joint.parent + first;
      both.joints.push_back(std::move(joint));
    }
  }
  const rig::Rig rig = rig::recognise(both);
  CHECK(rig.kind == rig::Kind::kPerson);
  CHECK(rig.bone[1] == Bone::kHips);
  REQUIRE_FALSE(rig.notes.empty());
  CHECK(rig.notes[0].find("two persons") != std::string::npos);
}

TEST_CASE("rig: without names the shape tells the limbs, and the feet which side is left") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kA, Mat::Identity(), 0.01);
  for (std::size_t j = 0; j < made.input.joints.size(); ++j) {
    made.input.joints[j].name = "J" + std::to_string(j);
  }
  const rig::Rig rig = rig::recognise(made.input);
  REQUIRE(rig.kind == rig::Kind::kPerson);
  for (const Bone bone : {Bone::kHips, Bone::kLeftUpperArm, Bone::kRightLowerArm,
                          Bone::kLeftUpperLeg, Bone::kRightFoot, Bone::kHead}) {
    INFO(bone_name(bone));
    CHECK(rig.bone[static_cast<std::size_t>(bone)] == bone);
  }
  CHECK(has_note(rig, "by shape only"));
}

// A person of whom neither names nor feet say which side is left.
test::Made faceless(const Vec& to_toes = Vec::Zero()) {
  auto made = test::make(test::kSchemes[0], ZeroPose::kA, Mat::Identity(), 0.01);
  auto& joints = made.input.joints;
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j].name = "J" + std::to_string(j);
  for (const Bone bone : {Bone::kLeftToes, Bone::kRightToes}) {
    joints[static_cast<std::size_t>(bone)].offset = to_toes;
  }
  return made;
}

// The same person in a mirror, whose right limbs come first in the file.
void mirror(test::Made& made) {
  const auto flip = [](Vec& v) { v.x() = -v.x(); };
  for (auto& joint : made.input.joints) {
    flip(joint.offset);
    if (joint.end_site) flip(*joint.end_site);
  }
  for (Vec& position : made.input.poses.position) flip(position);
  for (auto& q : made.input.poses.rotation) q = {q.w(), q.x(), -q.y(), -q.z()};
}

TEST_CASE("rig: where neither names nor feet say which side is left, knees and elbows do") {
  for (const bool mirrored : {false, true}) {
    auto made = faceless();
    if (mirrored) mirror(made);
    const rig::Rig rig = rig::recognise(made.input);
    INFO((mirrored ? "mirrored" : "as made"));
    CHECK(rig.facing == "+z");
    const auto arm = static_cast<std::size_t>(Bone::kLeftUpperArm);
    CHECK(rig.bone[arm] == (mirrored ? Bone::kRightUpperArm : Bone::kLeftUpperArm));
    CHECK(rig.evidence[arm].sure > 0.8);
    made.input.poses = {};
    CHECK(rig::recognise(made.input).evidence[arm].sure < 0.5);
  }
}

TEST_CASE("rig: how limbs bend swaps no limb whose sides the names say") {
  for (const bool legs_are_named : {false, true}) {
    auto made = faceless();
    mirror(made);
    const int first = static_cast<int>(legs_are_named ? Bone::kLeftUpperLeg : Bone::kLeftShoulder);
    for (int b = first; b < first + 8; ++b) {
      made.input.joints[b].name += b < first + 4 ? "_R" : "_L";
      for (int i = 0; i < made.input.poses.count; ++i) {  // named limbs do not bend
        made.input.poses.rotation[i * test::kMakerJoints + b].setIdentity();
      }
    }
    const rig::Rig rig = rig::recognise(made.input);
    INFO((legs_are_named ? "legs" : "arms"));
    const Bone right = legs_are_named ? Bone::kRightLowerLeg : Bone::kRightLowerArm;
    CHECK(rig.bone[first + (legs_are_named ? 1 : 2)] == right);
    CHECK(has_note(rig, "neither names, feet nor bends"));
  }
}

TEST_CASE("rig: where neither names, feet nor bends say which side is left, the facing axis does") {
  const auto asks = [](const rig::Rig& rig) { return has_note(rig, "facing"); };
  const auto left_arm = static_cast<std::size_t>(Bone::kLeftUpperArm);
  const auto right_arm = static_cast<std::size_t>(Bone::kRightUpperArm);
  for (const double below : {0.0, -1.0}) {
    auto made = faceless(Vec(0, below, 0));
    made.input.poses = {};
    CHECK(asks(rig::recognise(made.input)));
    for (const bool ahead : {true, false}) {
      made.input.facing = Vec(0, 0, ahead ? 1 : -1);
      const rig::Rig rig = rig::recognise(made.input);
      CHECK_FALSE(asks(rig));
      CHECK(rig.facing == (ahead ? "+z" : "-z"));
      CHECK(rig.bone[ahead ? left_arm : right_arm] == Bone::kLeftUpperArm);
    }
  }
}

TEST_CASE("rig: the user's word on where it faces goes before the names, and that is said") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  CHECK(rig::recognise(made.input).facing == "+z");
  made.input.facing = Vec(0, 0, -1);
  const rig::Rig rig = rig::recognise(made.input);
  CHECK(rig.facing == "-z");
  CHECK(rig.bone[static_cast<std::size_t>(Bone::kLeftHand)] == Bone::kRightHand);
  CHECK_FALSE(rig.notes.empty());
  made.input.facing = Vec(1, 0, 0);  // across it: said, and nothing changes
  CHECK_FALSE(rig::recognise(made.input).notes.empty());
}

TEST_CASE("rig: what a caller knows goes before what is recognised") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.bones.resize(test::kMakerJoints);
  for (int b = 0; b < test::kMakerJoints; ++b) made.input.bones[b] = static_cast<Bone>(b);
  made.input.bones[1].reset();  // no spine
  const auto known = Eigen::Quaterniond(yaw(90));
  made.input.T.resize(test::kMakerJoints);
  made.input.T[static_cast<std::size_t>(Bone::kLeftHand)] = known;
  made.input.metres_per_unit = 0.02;
  made.input.up = UpAxis::kMinusZ;
  const rig::Rig rig = rig::recognise(made.input);
  CHECK_FALSE(rig.bone[1].has_value());
  CHECK(rig.T[static_cast<std::size_t>(Bone::kLeftHand)].isApprox(known));
  CHECK(rig.metres_per_unit == 0.02);
  CHECK(rig.up == UpAxis::kMinusZ);
}

// The same figure without names, and with a joint of its own for the legs beside the spine.
test::Made unnamed_with_pelvis(test::Made made, bool has_pelvis) {
  auto& joints = made.input.joints;
  if (has_pelvis) {
    const auto first = static_cast<int>(Bone::kLeftUpperLeg);  // the limbs' last eight are the legs
    joints.insert(joints.begin() + first,
                  {.name = "", .parent = 0, .offset = Vec::Zero(), .end_site = {}});
    for (std::size_t j = first + 1; j < joints.size(); ++j) {
      joints[j].parent = joints[j].parent == 0 ? first : joints[j].parent + 1;
    }
  }
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j].name = "J" + std::to_string(j);
  made.input.poses = {};
  return made;
}

TEST_CASE(
    "rig: the legs may hang on a joint of their own beside the spine, and a hand hold swords") {
  std::mt19937 random(5);
  for (const bool has_pelvis : {false, true}) {
    for (const ZeroPose zero : {ZeroPose::kT, ZeroPose::kA, ZeroPose::kArmsDown}) {
      for (const double sword_m : {0.0, 1.3}) {
        const test::Build build{.height = 0.8 + 0.1 * below(random, 5), .axes = {}};
        auto made = unnamed_with_pelvis(
            test::make(test::kSchemes[0], zero, yaw(30.0 * below(random, 12)), 0.01, 0, 1, build),
            has_pelvis);
        auto& joints = made.input.joints;
        for (const Bone hand : {Bone::kLeftHand, Bone::kRightHand}) {
          if (sword_m <= 0.0) continue;
          int parent = static_cast<int>(hand);
          const double length = hand == Bone::kLeftHand ? sword_m : sword_m / 2;
          for (const Vec& way : {Vec(0, -7, 10), Vec(10, 10, 100 * length)}) {
            const auto name = "J" + std::to_string(joints.size());
            joints.push_back({.name = name, .parent = parent, .offset = way, .end_site = {}});
            parent = static_cast<int>(joints.size()) - 1;
          }
        }
        INFO("zero pose " << static_cast<int>(zero) << ", sword " << sword_m << " m");
        const rig::Rig rig = rig::recognise(made.input);
        REQUIRE(rig.kind == rig::Kind::kPerson);
        for (const Bone bone :
             {Bone::kHips, Bone::kHead, Bone::kLeftShoulder, Bone::kLeftUpperArm,
              Bone::kLeftLowerArm, Bone::kLeftHand, Bone::kRightHand, Bone::kLeftUpperLeg,
              Bone::kRightLowerLeg, Bone::kRightFoot, Bone::kRightToes}) {
          const auto b = static_cast<std::size_t>(bone);
          const bool leg = bone >= Bone::kLeftUpperLeg && has_pelvis;
          INFO(bone_name(bone));
          CHECK(rig.bone[b + (leg ? 1 : 0)] == bone);
        }
      }
    }
  }
}

// Joints that are added one by one.
struct Builder {
  rig::RigInput input;

  int add(const std::string& name, int parent, const Vec& offset) {
    input.joints.push_back({.name = name, .parent = parent, .offset = offset, .end_site = {}});
    return static_cast<int>(input.joints.size()) - 1;
  }
};

TEST_CASE("rig: pieces of a limb that are only numbered are told by their lengths") {
  enum End { kNamed, kCalledEnd, kNumbered };
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    Builder made;
    std::map<Bone, int> truth;
    const End end_is = static_cast<End>(below(random, 3));
    const int first_number = below(random, 2);
    const int hips = made.add("hip", -1, {0, 95, 0});
    const int spine = made.add("spine1", hips, {0, 12, 0});
    const int chest = made.add("spine2", spine, {0, 25, 0});
    made.add("head", made.add("neck", chest, {0, 18, 0}), {0, 10, 0});
    // One bone in equal pieces; returns where it ends.
    const auto add_bone = [&](int joint, const std::string& name, int& number, int pieces,
                              const Vec& way) {
      for (int i = 1; i < pieces; ++i) {
        joint = made.add(name + std::to_string(number++), joint, way / pieces);
      }
      return joint;
    };
    const std::array pieces{1 + below(random, 3), 1 + below(random, 3)};
    for (const Side side : rig::kSides) {
      const std::string letter = side == Side::kLeft ? "l" : "r";
      const double out = side == Side::kLeft ? 1 : -1;
      const auto add_limb = [&](int parent, const std::string& limb, const char* end, Bone upper,
                                const std::array<Vec, 3>& ways) {
        const std::string name = limb + '_' + letter + '_';
        int number = first_number;
        const auto at = [&](int after) {
          return rig::on(side, static_cast<Bone>(static_cast<int>(upper) + after));
        };
        int joint = truth[at(0)] = made.add(name + std::to_string(number++), parent, ways[0]);
        joint = add_bone(joint, name, number, pieces[0], ways[1]);
        joint = truth[at(1)] =
            made.add(name + std::to_string(number++), joint, ways[1] / pieces[0]);
        joint = add_bone(joint, name, number, pieces[1], ways[2]);
        const std::string last = end_is == kNamed       ? std::string(end) + '_' + letter
                                 : end_is == kCalledEnd ? name + "end"
                                                        : name + std::to_string(number);
        return truth[at(2)] = made.add(last, joint, ways[2] / pieces[1]);
      };
      const int collar = made.add("clavicle_" + letter, chest, {3 * out, 12, 0});
      add_limb(collar, "arm", "hand", Bone::kLeftUpperArm,
               {Vec(14 * out, 0, 0), Vec(28 * out, 0, 0), Vec(25 * out, 0, 0)});
      const int foot = add_limb(hips, "leg", "foot", Bone::kLeftUpperLeg,
                                {Vec(9 * out, -3, 0), Vec(0, -42, 0), Vec(0, -40, 0)});
      truth[rig::on(side, Bone::kLeftToes)] =
          made.add((end_is == kCalledEnd ? "foot_" : "toe_") + letter, foot, {0, -8, 13});
    }
    INFO("pieces " << pieces[0] << ' ' << pieces[1] << ", end " << static_cast<int>(end_is));
    const rig::Rig rig = rig::recognise(made.input);
    for (const auto& [bone, joint] : truth) {
      INFO(bone_name(bone));
      CHECK(rig.bone[joint] == bone);
    }
  }
}

TEST_CASE(
    "rig: an arm whose joints are counted from the shoulder on is the same in any zero pose") {
  for (const ZeroPose zero : {ZeroPose::kT, ZeroPose::kA, ZeroPose::kArmsDown}) {
    auto made = test::make(test::kSchemes[10], zero, Mat::Identity(), 0.01);
    for (const int first : {6, 10}) {
      for (int i = 0; i < 4; ++i) {
        made.input.joints[first + i].name = (first == 6 ? "L_Arm_" : "R_Arm_") + std::to_string(i);
      }
    }
    INFO("zero pose " << static_cast<int>(zero));
    check_made(made, UpAxis::kPlusY, 0.01);
  }
}

// A hand alone, palm first, and then its fingers, thumb first, in centimetres: a right one whose
// fingers lead along +x and whose palm faces down.
rig::RigInput made_hand(double size, const Mat& turn, bool has_palm_bones) {
  Builder made;
  const int palm = made.add("B0", -1, Vec::Zero());
  constexpr std::array kRow{2.6, 3.0, 0.8, -1.4, -3.4};
  constexpr std::array kOut{2.0, 9.0, 9.2, 8.8, 8.0};
  constexpr std::array kLength{1.1, 1.0, 1.08, 1.0, 0.8};
  for (std::size_t f = 0; f < kFingers; ++f) {
    int parent = palm;
    const auto add = [&](const Vec& way) {
      parent =
          made.add("B" + std::to_string(made.input.joints.size()), parent, size * (turn * way));
    };
    Vec base(kOut[f], f == 0 ? -0.5 : 0.0, kRow[f]);
    if (has_palm_bones && f > 0) {
      const Vec in_palm = 0.2 * base;
      add(in_palm);
      base -= in_palm;
    }
    add(base);
    const Vec along = f == 0 ? Vec(3, -0.5, 2.5) : Vec(4.2, 0, 0);
    for (const double part : {1.0, 0.6}) add(kLength[f] * part * along);
  }
  return made.input;
}

TEST_CASE(
    "rig: a hand alone is told by its shape where no name says it, and no fingers are a body") {
  std::mt19937 random(9);
  for (int round = 0; round < 40; ++round) {
    const bool palm_bones = round % 2 == 0;
    const double size = 0.9 + 0.05 * below(random, 5);
    const Mat turn = axis_turn(random) * yaw(10.0 * below(random, 36));
    const auto hand = made_hand(size, turn, palm_bones);
    const rig::Rig rig = rig::recognise(hand);
    REQUIRE(rig.kind == rig::Kind::kHand);
    CHECK(rig.metres_per_unit == Approx(0.01));
    REQUIRE(rig.bone[0].has_value());
    const Side side = *rig.bone[0] == Bone::kLeftHand ? Side::kLeft : Side::kRight;
    int joint = 1;
    for (int f = 0; f < kFingers; ++f) {
      if (palm_bones && f > 0) ++joint;
      for (int i = 0; i < kFingerJoints; ++i, ++joint) {
        const int first = static_cast<int>(Bone::kLeftThumbMetacarpal) + kFingerJoints * f;
        CHECK(rig.bone[joint] == rig::on(side, static_cast<Bone>(first + i)));
      }
    }
    CHECK(std::ranges::any_of(rig.notes, [](const std::string& note) {
      return note.find("by its shape") != std::string::npos;
    }));
    // Two hands on one joint are nobody.
    rig::RigInput both;
    both.joints.push_back({.name = "B", .parent = -1, .offset = Vec::Zero(), .end_site = {}});
    for (const double x : {40.0, -40.0}) {
      const int first = static_cast<int>(both.joints.size());
      for (auto part : hand.joints) {
        if (part.parent < 0) part.offset.x() = x;
        part.parent = part.parent < 0 ? 0 : part.parent + first;
        both.joints.push_back(std::move(part));
      }
    }
    CHECK(rig::recognise(both).kind != rig::Kind::kPerson);
  }
}

TEST_CASE("rig: a toe aside of a folded foot's own axis does not turn the foot") {
  for (const double aside_m : {-0.03, 0.0, 0.03}) {
    auto made = test::make(test::kSchemes[1], ZeroPose::kFolded, Mat::Identity(), 0.01);
    const auto joints = made.input.joints.size();
    for (const Bone toes : {Bone::kLeftToes, Bone::kRightToes}) {
      const auto j = static_cast<std::size_t>(toes);
      const Vec left(toes == Bone::kLeftToes ? aside_m : -aside_m, 0, 0);
      made.input.joints[j].offset += made.T[j].transpose() * left / 0.01;
      for (int i = 0; i < made.input.poses.count; ++i) {
        made.input.poses.position[i * joints + j] = made.input.joints[j].offset;
      }
    }
    CHECK(worst_deg(rig::recognise(made.input), made) < 1.0);
  }
}

// A person in a folded zero pose lies along -z or stands: `root_m` is its hips' height in the zero
// pose, and `floor_m` what they are above the floor when it lies.
test::Made lying(double root_m, double floor_m, bool lies) {
  auto made = test::make(test::kSchemes[0], ZeroPose::kFolded, Mat::Identity(), 0.01);
  const auto joints = made.input.joints.size();
  made.input.joints[0].offset = Vec(0, root_m / 0.01, 0);
  for (int i = 0; lies && i < made.input.poses.count; ++i) {
    const Mat back = Eigen::AngleAxisd(-88 * kDegree, rig::kX).toRotationMatrix();
    auto& hips = made.input.poses.rotation[i * joints];
    hips = Eigen::Quaterniond(Mat(back * hips.toRotationMatrix()));
    made.input.poses.position[i * joints] = Vec(10, floor_m / 0.01, 0.1 * i);
    for (std::size_t j = 1; j < joints; ++j) {
      const bool moves = j == static_cast<std::size_t>(Bone::kLeftLowerArm);
      auto& turn = made.input.poses.rotation[i * joints + j];
      if (!moves) turn = made.input.poses.rotation[j];
    }
  }
  return made;
}

TEST_CASE("rig: who lies in a clip does not stand along another axis") {
  for (const double root_m : {0.95, 0.0}) {
    for (const bool lies : {false, true}) {
      INFO("root " << root_m << " m, lies " << lies);
      const rig::Rig rig = rig::recognise(lying(root_m, 0.1, lies).input);
      CHECK(up_text(rig.up) == "+y");
      const auto says = [&rig](std::string_view part) {
        return std::ranges::any_of(rig.notes,
                                   [part](const std::string& note) { return note.contains(part); });
      };
      CHECK(says("lies on its side") == lies);
      CHECK(says("which axis points up is not sure") == (lies && root_m <= 0.0));
    }
  }
}

// A person in a folded zero pose, who sits through the clip; `root` is the hips' offset [m].
test::Made sitting(UpAxis up, const Vec& root) {
  const Mat axes = up_turn(up).transpose();
  auto made = test::make(test::kSchemes[0], ZeroPose::kFolded, axes, 0.01);
  auto& [count, rotation, position] = made.input.poses;
  const auto joints = made.input.joints.size();
  made.input.joints[0].offset = root / 0.01;
  for (int i = 0; i < count; ++i) {
    const auto turn = [&](std::size_t j, double deg) {
      const Mat local = Eigen::AngleAxisd(deg * kDegree, rig::kX).toRotationMatrix();
      const Mat& T_parent = made.T[made.input.joints[j].parent];
      rotation[i * joints + j] = Eigen::Quaterniond(Mat(T_parent.transpose() * local * made.T[j]));
    };
    for (const Bone thigh : {Bone::kLeftUpperLeg, Bone::kRightUpperLeg}) {
      turn(static_cast<std::size_t>(thigh), -90);
      turn(static_cast<std::size_t>(thigh) + 1, 90);
      turn(static_cast<std::size_t>(thigh) + 2, 0);
    }
    position[i * joints] = axes * Vec(0, 45, 0);
  }
  return made;
}

TEST_CASE("rig: who sits through a clip is upright, whatever a folded zero pose says of the root") {
  check_made(sitting(UpAxis::kPlusY, Vec(0.95, 0, 0)), UpAxis::kPlusY, 0.01);
  check_made(sitting(UpAxis::kPlusY, Vec::Zero()), UpAxis::kPlusY, 0.01);
  check_made(sitting(UpAxis::kPlusZ, Vec::Zero()), UpAxis::kPlusZ, 0.01);
}

// By its length alone decimetres are likelier.
TEST_CASE("rig: a joint called LHipJoint says CMU's unit of length, of a short person, too") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.0254 / 0.45, 0, 1,
                         {.height = 0.85, .axes = {}});
  made.input.joints.push_back(
      {.name = "LHipJoint", .parent = 0, .offset = Vec::Zero(), .end_site = {}});
  made.input.poses = {};
  CHECK(rig::recognise(made.input).metres_per_unit == Approx(0.0254 / 0.45));
}

TEST_CASE("rig: short legs below a long trunk are a child's, not a giant's in inches") {
  const auto unit_of = [](double metres_per_unit, const test::Build& build) {
    auto made =
        test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), metres_per_unit, 0, 1, build);
    made.input.poses = {};
    return rig::recognise(made.input).metres_per_unit;
  };
  CHECK(unit_of(0.01, {.trunk = 0.85, .legs = 0.55, .axes = {}}) == Approx(0.01));
  CHECK(unit_of(0.01, {.height = 0.65, .legs = 0.8, .axes = {}}) == Approx(0.01));
  CHECK(unit_of(0.01, {.height = 0.53, .axes = {}}) == Approx(0.01));
  CHECK(unit_of(1.0, {.height = 0.48, .axes = {}}) == Approx(1.0));
  CHECK(unit_of(0.0254, {}) == Approx(0.0254));
  CHECK(unit_of(0.0254, {.height = 0.85, .axes = {}}) == Approx(0.0254));
  CHECK(unit_of(0.0254, {.height = 1.1, .axes = {}}) == Approx(0.0254));
}

TEST_CASE("rig: Valve's names say inches, of a giant, too") {
  const auto valve = std::ranges::find_if(test::kSchemes, [](const test::Scheme& scheme) {
    return std::string_view(scheme.names[0]).starts_with("ValveBiped");
  });
  REQUIRE(valve != test::kSchemes.end());
  const auto made =
      test::make(*valve, ZeroPose::kT, Mat::Identity(), 0.0254, 0, 1, {.height = 1.3, .axes = {}});
  CHECK(rig::recognise(made.input).metres_per_unit == Approx(0.0254));
}

TEST_CASE("rig: arms raised beside the head are raised, and not folded") {
  for (const double raised_deg : {45.0, 60.0}) {
    for (const int frames : {1, 40}) {
      check_made(test::make(test::kSchemes[0], ZeroPose::kA, Mat::Identity(), 0.01, 0, frames,
                            {.arms_down_deg = -raised_deg, .axes = {}}),
                 UpAxis::kPlusY, 0.01);
    }
  }
}

TEST_CASE("rig: a mark beside a hand is no elbow") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  auto& joints = made.input.joints;
  made.input.poses = {};
  for (const bool left : {true, false}) {
    const std::string side = left ? "_L" : "_R";
    const auto arm = static_cast<std::size_t>(left ? Bone::kLeftUpperArm : Bone::kRightUpperArm);
    joints[arm].name = "Arm_1" + side;
    joints[arm + 1].name = "Arm_2" + side;
    joints[arm + 2].name = "Wrist" + side;
    joints.push_back({.name = "Elbow" + side,
                      .parent = static_cast<int>(arm) + 1,
                      .offset = Vec::Zero(),
                      .end_site = {}});
  }
  check_made(made, UpAxis::kPlusY, 0.01);
}

TEST_CASE("rig: a piece of hips that are called root is no spine") {
  const auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  rig::RigInput input;
  for (const auto& joint : made.input.joints) {
    if (joint.parent == 0 && input.joints.size() == 1) {
      input.joints.push_back(
          {.name = "RootPart1_M", .parent = 0, .offset = {0, 3, 0}, .end_site = {}});
    }
    const std::size_t at = input.joints.size();
    input.joints.push_back(joint);
    int& parent = input.joints.back().parent;
    parent += at == 2 || parent > 0 ? 1 : 0;
  }
  input.joints[0].name = "Root_M";
  const rig::Rig rig = rig::recognise(input);
  CHECK(rig.bone[0] == Bone::kHips);
  CHECK(!rig.bone[1]);
  CHECK(rig.bone[2] == Bone::kSpine);
}

TEST_CASE("rig: a finger's joint called after the tip of its segment is a bone") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  auto& joints = made.input.joints;
  made.input.poses = {};
  for (const std::string name :
       {"Metacarpal", "Knuckle", "IntermediateBase", "IntermediateTip", "Tip"}) {
    const int parent = name == "Metacarpal" ? static_cast<int>(Bone::kLeftHand)
                                            : static_cast<int>(joints.size()) - 1;
    joints.push_back({.name = "LeftHandIndexFinger" + name,
                      .parent = parent,
                      .offset = {3, 0, 0},
                      .end_site = {}});
  }
  const rig::Rig rig = rig::recognise(made.input);
  const std::size_t knuckle = test::kMakerJoints + 1;
  CHECK(rig.bone[knuckle] == Bone::kLeftIndexProximal);
  CHECK(rig.bone[knuckle + 2] == Bone::kLeftIndexDistal);
  CHECK(!rig.bone[knuckle + 3]);
}

TEST_CASE("rig: a neck and a head that no name tells need no end of the head") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  auto& joints = made.input.joints;
  made.input.poses = {};
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j].name = "J" + std::to_string(j);
  joints[static_cast<std::size_t>(Bone::kHead)].end_site.reset();
  constexpr auto kHead = static_cast<std::size_t>(Bone::kHead);
  for (const double head : {9, 20}) {                              // of an ape
    joints[static_cast<std::size_t>(Bone::kNeck)].offset.y() = 8;  // of a spine that ends high
    joints[kHead].offset.y() = head;
    const rig::Rig rig = rig::recognise(made.input);
    CHECK(rig.bone[static_cast<std::size_t>(Bone::kNeck)] == Bone::kNeck);
    CHECK(rig.bone[kHead] == Bone::kHead);
  }
}

TEST_CASE("rig: the joint that carries both arms is a bone, though it is called a top") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.joints[static_cast<std::size_t>(Bone::kUpperChest)].name = "Spine_Top";
  check_made(made, UpAxis::kPlusY, 0.01);
}

TEST_CASE("rig: a second pair of arms is one whose names have a number more") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  std::vector<rig::RigJoint> more;
  for (const int first : {6, 10}) {
    int parent = static_cast<int>(Bone::kChest);
    for (int b = first; b < first + 4; ++b) {
      more.push_back(made.input.joints[b]);
      more.back().name += '2';
      more.back().parent = parent;
      parent = static_cast<int>(made.input.joints.size() + more.size()) - 1;
    }
  }
  add_joints(made, more);
  made.input.poses = {};
  const rig::Rig rig = rig::recognise(made.input);
  for (int b = 0; b < test::kMakerJoints; ++b) {
    INFO(made.input.joints[b].name);
    CHECK(rig.bone[b] == static_cast<Bone>(b));
  }
}

TEST_CASE("rig: axes in a name say nothing") {
  auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  for (const bool left : {true, false}) {
    const auto thigh = static_cast<std::size_t>(left ? Bone::kLeftUpperLeg : Bone::kRightUpperLeg);
    const std::array names{"femurYZ", "femurX", "tibia", "talus"};
    for (std::size_t k = 0; k < names.size(); ++k) {
      made.input.joints[thigh + k].name = std::string(left ? "l" : "r") + names[k];
    }
  }
  const rig::Rig rig = rig::recognise(made.input);
  const auto first = static_cast<std::size_t>(Bone::kLeftUpperLeg);
  CHECK(rig.bone[first] == Bone::kLeftUpperLeg);
  CHECK(!rig.bone[first + 1]);
  CHECK(rig.bone[first + 2] == Bone::kLeftLowerLeg);
}

TEST_CASE("rig: a person who lacks an arm or a leg faces, stands and measures as with it") {
  std::mt19937 random(34);
  // The first joint that is lost; of 7 and 11 a shoulder is left.
  for (const int first : {6, 7, 10, 11, 14, 18}) {
    const int lost = first == 7 || first == 11 ? 3 : 4;
    for (const ZeroPose zero : {ZeroPose::kT, ZeroPose::kA, ZeroPose::kArmsDown}) {
      const bool z_up = random() % 2 == 0;
      const Mat turn = Eigen::AngleAxisd(90.0 * kDegree * static_cast<double>(random() % 4),
                                         z_up ? rig::kZ : rig::kY)
                           .toRotationMatrix();
      const Mat axes = turn * (z_up ? Mat(up_turn(UpAxis::kPlusZ).transpose()) : Mat::Identity());
      const auto whole =
          test::make(test::kSchemes[random() % test::kSchemes.size()], zero, axes, 0.01);
      test::Made made;
      made.input.poses.count = whole.input.poses.count;
      const auto is_lost = [first, lost](int b) { return b >= first && b < first + lost; };
      for (int b = 0; b < test::kMakerJoints; ++b) {
        if (is_lost(b)) continue;
        made.bone.push_back(static_cast<Bone>(b));
        made.T.push_back(whole.T[b]);
        made.input.joints.push_back(whole.input.joints[b]);
        int& parent = made.input.joints.back().parent;
        if (parent >= first) parent -= lost;
      }
      for (int i = 0; i < made.input.poses.count * test::kMakerJoints; ++i) {
        if (is_lost(i % test::kMakerJoints)) continue;
        made.input.poses.rotation.push_back(whole.input.poses.rotation[i]);
        made.input.poses.position.push_back(whole.input.poses.position[i]);
      }
      INFO(made.input.joints.back().name << " limb " << first << " zero "
                                         << static_cast<int>(zero));
      check_made(made, z_up ? UpAxis::kPlusZ : UpAxis::kPlusY, 0.01);
      const rig::Rig rig = rig::recognise(made.input);
      CHECK(rig.facing == axis_text(axes * rig::kZ));
      REQUIRE_FALSE(rig.notes.empty());
      CHECK(rig.notes[0].find("is not whole") != std::string::npos);
    }
  }
}

TEST_CASE("rig: without names wings, capes, long hair and weapons are no limbs") {
  // Chains of a joint: their steps of the left side [cm].
  struct Extra {
    Bone at;
    std::vector<Vec> steps;
  };
  const std::vector<std::vector<Extra>> extras{
      {{Bone::kUpperChest, {{6, 5, -10}, {35, 35, -10}, {60, 10, -5}, {58, -30, 0}}}},
      {{Bone::kHead, {{10, 12, -5}, {10, -20, -5}, {5, -35, -2}, {2, -35, -2}}}},
      {{Bone::kLeftHand, {{5, 0, 0}, {0, 0, 50}, {0, 0, 50}}},
       {Bone::kUpperChest, {{0, 5, -10}, {0, -35, -5}, {0, -35, -5}, {0, -35, -5}}}},
      {{Bone::kLeftLowerArm, {{0, 5, 8}, {0, 45, 0}}},
       {Bone::kRightHand, {{0, 0, 5}, {0, 0, 90}}}}};
  for (const auto& extra : extras) {
    auto made = test::make(test::kSchemes[0], ZeroPose::kT, Mat::Identity(), 0.01);
    made.input.poses = {};
    auto& joints = made.input.joints;
    for (const auto& [at, steps] : extra) {
      for (const Side side : rig::kSides) {
        const bool is_middle = steps[0].x() == 0.0;
        if (is_middle && side == Side::kRight) continue;
        const bool on_limb = at == Bone::kLeftHand;
        int parent = static_cast<int>(on_limb ? rig::on(side, at) : at);
        for (Vec step : steps) {
          if (side == Side::kRight) step.x() = -step.x();
          joints.push_back({.name = "", .parent = parent, .offset = step, .end_site = {}});
          parent = static_cast<int>(joints.size()) - 1;
        }
      }
    }
    for (std::size_t j = 0; j < joints.size(); ++j) joints[j].name = "J" + std::to_string(j);
    const rig::Rig rig = rig::recognise(made.input);
    REQUIRE(rig.kind == rig::Kind::kPerson);
    for (int b = 0; b < test::kMakerJoints; ++b) {
      INFO("extra " << &extra - extras.data() << ' ' << bone_name(static_cast<Bone>(b)));
      CHECK(rig.bone[b] == static_cast<Bone>(b));
    }
    CHECK(worst_deg(rig, made) < 1.0);
  }
}

// The same figure, of whose joints names tell at most the side, with the bones of the `cut` slots
// of each limb (0 is an upper one) cut into equal pieces.
test::Made with_cut_limbs(const test::Made& whole, const std::vector<int>& cut, int pieces,
                          bool has_sides) {
  test::Made made;
  std::vector<int> now;  // [joint of the whole]
  for (int b = 0; b < test::kMakerJoints; ++b) {
    rig::RigJoint joint = whole.input.joints[b];
    if (joint.parent >= 0) joint.parent = now[joint.parent];
    const int slot = b >= 14 ? (b - 14) % 4 - 1 : b >= 6 ? (b - 6) % 4 - 2 : -1;
    const bool is_cut = std::ranges::find(cut, slot) != cut.end();
    if (is_cut) joint.offset /= pieces;
    for (int i = is_cut ? 1 : pieces; i <= pieces; ++i) {
      made.input.joints.push_back(joint);
      const std::string side = b < 6 || !has_sides             ? ""
                               : b < 10 || (b >= 14 && b < 18) ? "L_"
                                                               : "R_";
      made.input.joints.back().name = side + "joint_" + std::to_string(made.input.joints.size());
      if (i < pieces) made.input.joints.back().end_site.reset();
      joint.parent = static_cast<int>(made.input.joints.size()) - 1;
    }
    now.push_back(joint.parent);
  }
  made.bone.resize(made.input.joints.size(), Bone::kHips);  // of the joints in `T` alone
  made.T.resize(made.input.joints.size());
  for (int b = 0; b < test::kMakerJoints; ++b) {
    made.bone[now[b]] = static_cast<Bone>(b);
    made.T[now[b]] = whole.T[b];
  }
  return made;
}

TEST_CASE("rig: joints that cut the bones of limbs without names are passed over") {
  const test::Build tall{.height = 1.1, .trunk = 0.95, .arms = 1.08, .legs = 1.05, .axes = {}};
  const test::Build child{.height = 0.6, .trunk = 1.1, .arms = 0.95, .legs = 0.9, .axes = {}};
  for (const test::Build& build : {test::Build{}, tall, child}) {
    for (const ZeroPose zero :
         {ZeroPose::kT, ZeroPose::kA, ZeroPose::kArmsDown, ZeroPose::kFolded}) {
      const auto whole = test::make(test::kSchemes[0], zero, Mat::Identity(), 0.01, 0, 40, build);
      for (const std::vector<int>& cut : {std::vector{0, 1}, {0}, {1}}) {
        for (const int pieces : {2, 3}) {
          const auto made = with_cut_limbs(whole, cut, pieces, zero == ZeroPose::kFolded);
          const rig::Rig rig = rig::recognise(made.input);
          REQUIRE(rig.kind == rig::Kind::kPerson);
          int bones = 0;
          for (std::size_t j = 0; j < made.bone.size(); ++j) {
            INFO(made.input.joints[j].name << " of zero pose " << static_cast<int>(zero) << " cut "
                                           << cut.front() << cut.back() << " into " << pieces
                                           << ", height " << build.height);
            if (!rig.bone[j]) continue;
            ++bones;
            CHECK(bone_name(*rig.bone[j]) == bone_name(made.bone[j]));
            if (zero == ZeroPose::kFolded) continue;  // its twist is told by the clip
            CHECK(angle_between_rad(rig.T[j], Eigen::Quaterniond(made.T[j])) < 1.0 * kDegree);
          }
          CHECK(bones == test::kMakerJoints);
        }
      }
    }
  }
}

TEST_CASE("rig: fingers tell where an arm ends, though its bones are cut") {
  const test::Build ape{.arms = 1.2, .axes = {}};
  const test::Build small{.arms = 0.8, .axes = {}};
  for (const test::Build& build : {test::Build{}, ape, small}) {
    for (const ZeroPose zero : {ZeroPose::kT, ZeroPose::kA}) {
      auto whole = test::make(test::kSchemes[0], zero, Mat::Identity(), 0.01, 0, 1, build);
      whole.input.poses = {};
      auto made = with_cut_limbs(whole, {0, 1}, 3, false);
      const auto cut = static_cast<int>(made.input.joints.size());
      made = with_fingers(made, test::kSchemes[0], kForeignFingers[0], 0.01, 1.0);
      for (auto& joint : made.input.joints) joint.name = "x";
      const rig::Rig rig = rig::recognise(made.input);
      REQUIRE(rig.kind == rig::Kind::kPerson);
      for (int j = 0; j < cut; ++j) {
        INFO(j << " arms " << build.arms << " zero pose " << static_cast<int>(zero));
        if (rig.bone[j]) CHECK(bone_name(*rig.bone[j]) == bone_name(made.bone[j]));
      }
      CHECK(std::ranges::count(rig.bone, Bone::kLeftHand) == 1);
    }
  }
}

TEST_CASE("rig: a tree that begins at the chest is told, and not silently another's") {
  auto made = test::make(test::kSchemes[8], ZeroPose::kT, Mat::Identity(), 0.01);
  made.input.poses = {};
  const auto says = [](const rig::Rig& rig) {
    return std::ranges::any_of(rig.notes, [](const std::string& note) {
      return note.contains("the tree does not begin at the hips");
    });
  };
  CHECK_FALSE(says(rig::recognise(made.input)));
  // The trunk upside down: its last joint is the root, and the hips hang below it.
  constexpr int kTrunk = 4;
  auto joints = made.input.joints;
  for (int b = 0; b < kTrunk; ++b) {
    const int from = kTrunk - 1 - b;
    joints[b].name = made.input.joints[from].name;
    if (b > 0) joints[b].offset = -made.input.joints[from + 1].offset;
  }
  for (auto& joint : joints) {
    if (joint.parent == 0 || joint.parent == kTrunk - 1) joint.parent = kTrunk - 1 - joint.parent;
  }
  joints[1].parent = 0;
  joints[3].parent = 2;
  made.input.joints = joints;
  CHECK(says(rig::recognise(made.input)));
}

TEST_CASE("rig: any input ends in an answer") {
  const auto answer = [](const rig::RigInput& input) {
    const rig::Rig rig = rig::recognise(input);
    CHECK(rig.bone.size() == input.joints.size());
    for (const auto& T : rig.T) CHECK(std::abs(T.norm() - 1.0) < 1e-9);
  };
  answer({});
  constexpr int kMany = 3000;
  rig::RigInput deep;
  rig::RigInput wide;
  rig::RigInput chains;
  for (int j = 0; j < kMany; ++j) {
    const std::string name = (j % 2 == 0 ? "LeftArm" : "l") + std::string(j % 200, 'l');
    deep.joints.push_back({.name = name, .parent = j - 1, .offset = {0, 1, 0}, .end_site = {}});
    wide.joints.push_back(
        {.name = name, .parent = j == 0 ? -1 : 0, .offset = {1, 0, 0}, .end_site = {}});
    const int parent = j == 0 ? -1 : j % 3 == 1 ? 0 : j - 1;
    chains.joints.push_back({.name = "x", .parent = parent, .offset = {1, 0, 0}, .end_site = {}});
  }
  answer(deep);
  answer(wide);
  answer(chains);
  auto made = test::make(test::kSchemes[1], ZeroPose::kFolded, Mat::Identity(), 1.0);
  made.input.poses.rotation[7].w() = std::nan("");
  answer(made.input);
  made.input.joints[3].offset.x() = std::numeric_limits<double>::infinity();
  answer(made.input);
  for (auto& joint : made.input.joints) joint.offset.setZero();
  answer(made.input);
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    auto some = test::make(test::kSchemes[round % 12], ZeroPose::kT, Mat::Identity(), 1.0);
    for (auto& joint : some.input.joints) {
      joint.offset = Vec(below(random, 3) - 1, below(random, 3) - 1, below(random, 3) - 1);
    }
    answer(some.input);
  }
}

}  // namespace posed
