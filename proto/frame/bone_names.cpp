#include "proto/frame/bone_names.hpp"

#include <algorithm>
#include <array>
#include <string>

namespace posed {
namespace {

enum class NamedSide : std::uint8_t { kNone, kLeft, kRight };

// "mixamorig:LeftUpLeg" splits into side left, part "upleg".
struct Name {
  NamedSide side = NamedSide::kNone;
  std::string part;  // lower-case letters and digits only
};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }

std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (is_upper(c)) {
      out.push_back(static_cast<char>(c - 'A' + 'a'));
    } else if (is_letter(c) || (c >= '0' && c <= '9')) {
      out.push_back(c);
    }
  }
  return out;
}

// Parts that CMU skeletons prefix with one letter for the side: lfemur, RThumb, LHipJoint.
constexpr std::array<std::string_view, 12> kOneLetterParts{
    "hipjoint", "femur",  "tibia", "foot", "toes",    "clavicle",
    "humerus",  "radius", "wrist", "hand", "fingers", "thumb"};

Name split_name(std::string_view joint_name) {
  if (const std::size_t colon = joint_name.rfind(':'); colon != std::string_view::npos) {
    joint_name.remove_prefix(colon + 1);
  }
  if (joint_name.starts_with("mixamorig")) joint_name.remove_prefix(9);
  std::string part = plain(joint_name);
  for (const auto& [word, side] :
       {std::pair("left", NamedSide::kLeft), {"right", NamedSide::kRight}}) {
    const std::string_view text(word);
    if (part.starts_with(text)) return {side, part.substr(text.size())};
    if (part.ends_with(text)) return {side, part.substr(0, part.size() - text.size())};
  }
  if (joint_name.size() > 2 && part.size() > 1) {
    const auto side_of = [](char letter) {
      return letter == 'L' || letter == 'l'   ? NamedSide::kLeft
             : letter == 'R' || letter == 'r' ? NamedSide::kRight
                                              : NamedSide::kNone;
    };
    const NamedSide last = side_of(joint_name.back());
    if (last != NamedSide::kNone && !is_letter(joint_name[joint_name.size() - 2])) {
      return {last, part.substr(0, part.size() - 1)};  // UpperArm_L, thigh.R
    }
    const NamedSide first = side_of(joint_name.front());
    const std::string rest = part.substr(1);
    if (first != NamedSide::kNone &&
        (!is_letter(joint_name[1]) ||
         std::ranges::find(kOneLetterParts, rest) != kOneLetterParts.end())) {
      return {first, rest};  // L_Hand, lfemur
    }
  }
  return {NamedSide::kNone, part};
}

struct Part {
  std::string_view name;
  Bone left;  // the left bone, or the only one when the part has no side
};

constexpr std::array<Part, 5> kMiddle{{{"hips", Bone::kHips},
                                       {"pelvis", Bone::kHips},
                                       {"neck", Bone::kNeck},
                                       {"lowerneck", Bone::kNeck},
                                       {"head", Bone::kHead}}};

constexpr std::array<Part, 33> kLimbs{{
    {"upleg", Bone::kLeftUpperLeg},
    {"upperleg", Bone::kLeftUpperLeg},
    {"thigh", Bone::kLeftUpperLeg},
    {"femur", Bone::kLeftUpperLeg},
    {"hip", Bone::kLeftUpperLeg},
    {"leg", Bone::kLeftLowerLeg},
    {"lowerleg", Bone::kLeftLowerLeg},
    {"shin", Bone::kLeftLowerLeg},
    {"calf", Bone::kLeftLowerLeg},
    {"tibia", Bone::kLeftLowerLeg},
    {"knee", Bone::kLeftLowerLeg},
    {"foot", Bone::kLeftFoot},
    {"ankle", Bone::kLeftFoot},
    {"toebase", Bone::kLeftToes},
    {"toes", Bone::kLeftToes},
    {"toe", Bone::kLeftToes},
    {"shoulder", Bone::kLeftShoulder},
    {"clavicle", Bone::kLeftShoulder},
    {"collar", Bone::kLeftShoulder},
    {"arm", Bone::kLeftUpperArm},
    {"uparm", Bone::kLeftUpperArm},
    {"upperarm", Bone::kLeftUpperArm},
    {"humerus", Bone::kLeftUpperArm},
    {"forearm", Bone::kLeftLowerArm},
    {"lowerarm", Bone::kLeftLowerArm},
    {"radius", Bone::kLeftLowerArm},
    {"elbow", Bone::kLeftLowerArm},
    {"hand", Bone::kLeftHand},
    {"wrist", Bone::kLeftHand},
    {"thumbmetacarpal", Bone::kLeftThumbMetacarpal},
    {"thumbproximal", Bone::kLeftThumbProximal},
    {"thumbintermediate", Bone::kLeftThumbProximal},
    {"thumbdistal", Bone::kLeftThumbDistal},
}};

constexpr std::array<std::string_view, 10> kTrunk{
    "spine",  "chest",   "upperchest", "lowerback",  "upperback",
    "thorax", "abdomen", "torso",      "spineupper", "spinelower"};

Bone mirrored(Bone left, NamedSide side) {
  if (side == NamedSide::kLeft) return left;
  const std::string right = "right" + std::string(bone_name(left).substr(4));
  return *bone_from_name(right);
}

// Matches "handindex2", "index02" or "indexproximal" of a side.
std::optional<Bone> finger(std::string_view part) {
  if (part.starts_with("hand")) part.remove_prefix(4);
  constexpr std::array<std::pair<std::string_view, Bone>, 6> kFingers{
      {{"thumb", Bone::kLeftThumbMetacarpal},
       {"index", Bone::kLeftIndexProximal},
       {"middle", Bone::kLeftMiddleProximal},
       {"ring", Bone::kLeftRingProximal},
       {"pinky", Bone::kLeftLittleProximal},
       {"little", Bone::kLeftLittleProximal}}};
  constexpr std::array<std::string_view, 3> kJoints{"proximal", "intermediate", "distal"};
  for (const auto& [name, first] : kFingers) {
    if (!part.starts_with(name)) continue;
    std::string_view which = part.substr(name.size());
    if (which.starts_with('0')) which.remove_prefix(1);
    for (std::size_t i = 0; i < kJoints.size(); ++i) {
      const bool numbered = which.size() == 1 && which[0] == static_cast<char>('1' + i);
      const bool named = name != "thumb" && which == kJoints[i];
      if (numbered || named) return static_cast<Bone>(static_cast<std::size_t>(first) + i);
    }
  }
  return std::nullopt;
}

std::optional<Bone> bone_of(const Name& name, bool has_collars) {
  if (name.side == NamedSide::kNone) {
    const auto at = std::ranges::find(kMiddle, name.part, &Part::name);
    return at == kMiddle.end() ? std::nullopt : std::optional(at->left);
  }
  // When the collar has its own name, "shoulder" means the joint of the upper arm.
  if (has_collars && name.part == "shoulder") return mirrored(Bone::kLeftUpperArm, name.side);
  const auto at = std::ranges::find(kLimbs, name.part, &Part::name);
  const auto left = at == kLimbs.end() ? finger(name.part) : std::optional(at->left);
  return left ? std::optional(mirrored(*left, name.side)) : std::nullopt;
}

// Names the trunk's joints in order: one is the spine; two are spine and chest; three add the upper
// chest; of more, the first two and the last are named.
void name_trunk(Skeleton& skeleton, const std::vector<int>& trunk) {
  if (trunk.empty()) return;
  skeleton.joints[trunk[0]].bone = Bone::kSpine;
  if (trunk.size() > 1) skeleton.joints[trunk[1]].bone = Bone::kChest;
  if (trunk.size() > 2) skeleton.joints[trunk.back()].bone = Bone::kUpperChest;
}

}  // namespace

void name_bones(Skeleton& skeleton) {
  std::vector<Name> names;
  names.reserve(skeleton.joints.size());
  for (const Joint& joint : skeleton.joints) names.push_back(split_name(joint.name));
  const bool has_collars =
      std::ranges::any_of(names, [](const Name& name) { return name.part == "collar"; });
  std::vector<int> trunk;
  for (std::size_t j = 0; j < names.size(); ++j) {
    std::string stem = names[j].part;
    while (!stem.empty() && stem.back() >= '0' && stem.back() <= '9') stem.pop_back();
    if (names[j].side == NamedSide::kNone && std::ranges::find(kTrunk, stem) != kTrunk.end()) {
      trunk.push_back(static_cast<int>(j));
    }
    const auto bone = bone_of(names[j], has_collars);
    if (bone && skeleton.joint_of(*bone) < 0) skeleton.joints[j].bone = bone;
  }
  if (skeleton.joint_of(Bone::kHips) < 0 && (names[0].part == "root" || names[0].part == "hip")) {
    skeleton.joints[0].bone = Bone::kHips;
  }
  name_trunk(skeleton, trunk);
}

}  // namespace posed
