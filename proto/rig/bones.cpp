#include "proto/rig/bones.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "proto/text/clean.hpp"

namespace posed::rig {
namespace {

constexpr std::size_t kFingerBones = 15;

bool is_finger(const JointName& name) { return finger_of(name) || is_any_finger(name); }

// A hand alone: most joints are named as fingers, or the whole has the shape of one.
std::optional<BoneJoints> find_hand(const Figure& figure, const std::vector<JointName>& names,
                                    SidesBy& sides_by, std::vector<std::string>& notes) {
  std::vector<int> fingers;
  int sides = 0;
  bool named = false;
  for (int j = 0; j < figure.size(); ++j) {
    const int side = static_cast<int>(names[j].side);
    sides += side;
    named = named || side != 0;
    if (!is_finger(names[j]) || arm_fit(names[j])) continue;  // "fore" is a finger, a forearm none
    fingers.push_back(j);
  }
  const bool by_name = fingers.size() >= 6 && 10 * fingers.size() >= 6 * names.size();
  const auto shape = by_name ? std::nullopt : hand_by_shape(figure);
  if (!by_name && !shape) return std::nullopt;
  const Side side = sides > 0 ? Side::kLeft : Side::kRight;
  if (!named) sides_by = SidesBy::kNothing;
  BoneJoints bones;
  bones.set(on(side, Bone::kLeftHand), shape ? shape->palm : figure.common(fingers));
  if (!shape) {
    find_fingers(figure, names, side, bones);
    return bones;
  }
  notes.emplace_back("a hand by its shape: which finger is which is known by their places only");
  for (int b = 0; b < kFingers * kFingerJoints; ++b) {
    const auto& joints = shape->fingers[b / kFingerJoints];
    const std::size_t at = b % kFingerJoints;
    const auto left = static_cast<Bone>(static_cast<int>(Bone::kLeftThumbMetacarpal) + b);
    if (at < joints.size()) bones.set(on(side, left), joints[at]);
  }
  return bones;
}

// From a neck to its head at most, as part of the way from the chest to the head: a joint without
// an end site behind the first one is a head if it is as near, else the end of one.
constexpr double kNeck = 0.4;
constexpr double kNeckOfThigh = 0.28;  // or as part of a thigh, whatever the chest's place

// Whether the joint is one more of those that its maker counts, as "spine.006" is, and no farther
// away than they are from each other: the end of a head is.
bool goes_on(const Figure& figure, const std::vector<JointName>& names, int joint) {
  constexpr double kFar = 1.3;
  const int before = figure[joint].parent;
  return !names[joint].stem.empty() && names[joint].stem == names[before].stem &&
         names[joint].digits != names[before].digits &&
         figure[joint].offset.norm() <= kFar * figure[before].offset.norm();
}

// Whether the joint has a mirror image beside it, as ears, wings and strands of a cape have.
bool has_twin(const Figure& figure, int joint) {
  const double length = figure[joint].offset.norm();
  return std::ranges::any_of(figure.children(figure[joint].parent), [&](int other) {
    return other != joint && std::abs(length - figure[other].offset.norm()) < 0.01 * length &&
           figure.main_chain_length(joint) == figure.main_chain_length(other);
  });
}

void keep_if_any(std::vector<int>& joints, const auto& is_wanted) {
  std::vector<int> kept;
  std::ranges::copy_if(joints, std::back_inserter(kept), is_wanted);
  if (!kept.empty()) joints = std::move(kept);
}

// Whether hands, or most of their fingers, end without tips: then a head has none either. Most,
// because a thumb's first bone is as short as one in the palm.
bool hands_lack_tips(const Figure& figure, const BoneJoints& bones) {
  int lack = 0;
  for (const Side side : kSides) {
    const int hand = bones[on(side, Bone::kLeftHand)];
    if (hand < 0) return false;
    if (figure.children(hand).empty()) ++lack;
    for (const int child : figure.children(hand)) {
      const auto finger = figure.main_chain(child);
      const int whole = kFingerJoints + (begins_in_palm(figure, finger) ? 1 : 0);
      lack += std::ssize(finger) == whole ? 1 : -1;
    }
  }
  return lack > 0;
}

// Where the chain of neck and head begins, if neither is named: above the arms, and with no arm
// below it. -1 where there is none.
int first_above(const Figure& figure, const std::vector<JointName>& names, const BoneJoints& bones,
                int chest) {
  std::vector<int> rest;
  for (const int child : figure.children(chest)) {
    bool holds_limb = false;
    for (int b = 0; b < kBones; ++b) {
      const int joint = bones[static_cast<Bone>(b)];
      holds_limb = holds_limb || (joint >= 0 && figure.below(child, joint));
    }
    if (!holds_limb) rest.push_back(child);
  }
  std::vector<int> likely;
  std::ranges::copy_if(rest, std::back_inserter(likely), [&](int j) {
    return !names[j].helper && figure[j].offset.norm() > 0.0 && !has_twin(figure, j);
  });
  if (!likely.empty()) rest = likely;
  // A neck goes on as the trunk does; a cape hangs.
  const Vec trunk = figure.between(std::max(bones[Bone::kHips], 0), chest).value_or(Vec::Zero());
  keep_if_any(rest, [&](int j) {
    const auto tip = figure.between(chest, figure.main_chain(j).back()).value_or(Vec::Zero());
    return tip.dot(trunk) > 0.0;
  });
  const auto length = [&figure](int j) {
    double sum = 0.0;
    for (const double segment : figure.segments(figure.main_chain(j))) sum += segment;
    return sum;
  };
  return rest.empty() ? -1 : *std::ranges::max_element(rest, {}, length);
}

// The chain above the arms, or above a neck, that holds no arm.
std::vector<int> chain_above(const Figure& figure, const std::vector<JointName>& names,
                             const BoneJoints& bones, int chest) {
  const int first = first_above(figure, names, bones, chest);
  if (first < 0) return {};
  const bool from_chest = figure.below(chest, bones[Bone::kLeftUpperArm]);
  const bool lacks_tips = from_chest && hands_lack_tips(figure, bones);
  std::vector<int> chain;
  const double thigh = figure.between(bones[Bone::kLeftUpperLeg], bones[Bone::kLeftLowerLeg])
                           .value_or(Vec::Zero())
                           .norm();
  Vec way = Vec::Zero();
  for (const int j : figure.main_chain(first)) {
    const Vec step = figure.between(chest, j).value_or(Vec::Zero()) - way;
    constexpr double kBack = -0.3;
    const bool turns_back = !chain.empty() && direction(step).dot(direction(way)) < kBack;
    if (turns_back) {  // hair, which begins on the head
      if (chain.size() > 2) chain.pop_back();
      break;
    }
    way += step;
    const bool ends = figure.children(j).empty() && figure.end_length(j) <= 0.0;
    const double neck = std::max(kNeck * way.norm(), kNeckOfThigh * thigh);
    const bool is_head = chain.size() == 1 ? lacks_tips || step.norm() <= neck
                                           : chain.size() > 1 && goes_on(figure, names, j);
    const bool tip = ends && !is_head;
    if (!tip && !names[j].has("end") && !names[j].has("nub")) chain.push_back(j);
    const auto is_twin = [&figure](int child) { return has_twin(figure, child); };
    // Ears and eyes are on the head.
    if (chain.size() > 1 && std::ranges::any_of(figure.children(j), is_twin)) break;
  }
  // The top of a head is nearer to its end than to the head.
  const double end = chain.empty() ? 0.0 : figure.end_length(chain.back());
  if (chain.size() > 2 && figure.children(chain.back()).empty() && end > 0.0 &&
      !goes_on(figure, names, chain.back()) && figure[chain.back()].offset.norm() > 1.3 * end) {
    chain.pop_back();
  }
  // A face and a nose are on the head.
  while (chain.size() > 1 && names[chain.back()].helper) chain.pop_back();
  return chain.empty() ? std::vector{first} : chain;
}

struct Upper {
  int head = -1;
  int top = -1;  // where the path from the hips ends
};

Upper find_head(const Figure& figure, const std::vector<JointName>& names, const BoneJoints& bones,
                int chest, std::vector<std::string>& notes) {
  std::vector<int> necks;
  for (int j = 0; j < figure.size(); ++j) {
    if (is_head(names[j]) && figure.below(chest, j)) return {.head = j, .top = j};
    if (is_neck(names[j])) necks.push_back(j);
  }
  if (!necks.empty()) {
    const int neck = necks.back();
    if (necks.size() > 1) return {.head = neck, .top = neck};
    const auto above = chain_above(figure, names, bones, neck);
    const int head =
        above.empty() || names[above.back()].side != NameSide::kNone ? -1 : above.back();
    return {.head = head, .top = head < 0 ? neck : head};
  }
  const auto chain = chain_above(figure, names, bones, chest);
  if (chain.empty()) return {.top = chest};
  notes.emplace_back("head and neck are known by their place only");
  return {.head = chain.back(), .top = chain.back()};
}

// Drops joints by which the way from the hips comes back to where it was: spare ones, such as
// Second Life's mSpine1 to mSpine4.
void drop_returns(const Figure& figure, int hips, std::vector<int>& trunk) {
  std::vector<Vec> places{Vec::Zero()};  // of the hips and of the joints that stay
  std::vector<int> kept;
  for (const int j : trunk) {
    const Vec place = figure.between(hips, j).value_or(Vec::Zero());
    const double near = 0.01 * figure[j].offset.norm();
    const auto same = std::ranges::find_if(
        places, [&](const Vec& other) { return (place - other).norm() <= near; });
    const auto before = same - places.begin();
    if (same == places.end() || same + 1 == places.end()) {
      kept.push_back(j);
      places.push_back(place);
      continue;
    }
    kept.resize(static_cast<std::size_t>(before));
    places.resize(static_cast<std::size_t>(before) + 1);
  }
  trunk = std::move(kept);
}

// Vertebrae of makers who say which of them stand for spine, chest and upper chest: the numbers in
// their names, and the places of those three.
struct Vertebrae {
  std::array<std::string_view, 7> digits;
  std::array<std::size_t, 3> bones;
};
constexpr std::array kVertebrae{
    Vertebrae{{"5", "3", "12", "8"}, {0, 1, 3}},                // Xsens: L5, L3, T12, T8
    Vertebrae{{"1", "2", "3", "4", "5", "6", "7"}, {2, 4, 5}},  // mocopi: torso_1 to torso_7
};

bool set_vertebrae(const std::vector<int>& trunk, const std::vector<JointName>& names,
                   BoneJoints& bones) {
  for (const Vertebrae& known : kVertebrae) {
    const auto count = static_cast<std::size_t>(
        std::ranges::find(known.digits, std::string_view()) - known.digits.begin());
    if (trunk.size() != count) continue;
    std::size_t same = 0;
    while (same < count && names[trunk[same]].digits == known.digits[same]) ++same;
    const bool is_mocopi = names[trunk.back()].stem == "torso";
    if (same < count || (count == known.digits.size() && !is_mocopi)) continue;
    bones.set(Bone::kSpine, trunk[known.bones[0]]);
    bones.set(Bone::kChest, trunk[known.bones[1]]);
    bones.set(Bone::kUpperChest, trunk[known.bones[2]]);
    return true;
  }
  return false;
}

void set_trunk(const std::vector<int>& trunk, const std::vector<JointName>& names,
               BoneJoints& bones) {
  if (set_vertebrae(trunk, names, bones)) return;
  const std::size_t n = trunk.size();
  if (n > 0) bones.set(Bone::kSpine, trunk[0]);
  if (n == 2) bones.set(Bone::kChest, trunk[1]);
  if (n > 2) {
    bones.set(Bone::kChest, trunk[n / 2]);
    bones.set(Bone::kUpperChest, trunk.back());
  }
}

// Bones of an incomplete person, each by its name alone.
void find_parts(const Figure& figure, const std::vector<JointName>& names, BoneJoints& bones) {
  std::vector<int> trunk;
  for (int j = 0; j < figure.size(); ++j) {
    const auto take = [&](Bone bone) {
      if (!bones.has(bone)) bones.set(bone, j);
    };
    if (is_pelvis(names[j])) take(Bone::kHips);
    if (is_neck(names[j])) take(Bone::kNeck);
    if (is_head(names[j])) take(Bone::kHead);
    if (is_trunk(names[j])) trunk.push_back(j);
  }
  set_trunk(trunk, names, bones);
  if (bones.has(Bone::kHips) || trunk.empty() || figure[trunk[0]].parent != 0) return;
  if (names[0].stem == "root") bones.set(Bone::kHips, 0);
}

// Whether the joint lies where `top` above it lies.
bool lies_at(const Figure& figure, int top, int joint) {
  return figure.between(top, joint).value_or(kX).isZero(1e-6);
}

// The joints of a limb, from the first bone of the four on; -1 where there is none.
using LimbJoints = std::array<int, 4>;

// Of joints that lie at one place and are called as well, the last one turns the limb with all of
// them above it. A shoulder at its parent's place is the base of the one below it.
void settle_coincident(const Figure& figure, const std::vector<JointName>& names, bool is_leg,
                       LimbJoints& limb) {
  const auto fit = [&](int joint, std::size_t slot) {
    const auto found = is_leg ? leg_fit(names[joint]) : arm_fit(names[joint]);
    return found ? (*found)[slot] : 0.0;
  };
  for (std::size_t slot = 0; slot + 1 < limb.size(); ++slot) {
    const auto after = std::find_if(limb.begin() + static_cast<std::ptrdiff_t>(slot) + 1,
                                    limb.end(), [](int joint) { return joint >= 0; });
    int& at = limb[slot];
    if (at < 0 || after == limb.end() || !figure.below(at, *after)) continue;
    const int first = at;
    const int above = figure[first].parent;
    const bool is_base = !is_leg && slot == 0 && above >= 0 && lies_at(figure, above, first);
    for (const int j : figure.path(*after)) {
      if (j == first || j == *after || !figure.below(first, j)) continue;
      const bool is_same = lies_at(figure, at, j) && fit(j, slot) >= fit(at, slot);
      const bool is_above = is_base && !lies_at(figure, j, *after);
      if (fit(j, slot) > 0.0 && (is_same || is_above)) at = j;
    }
  }
}

void settle_limbs(const Figure& figure, const std::vector<JointName>& names, BoneJoints& bones) {
  for (const Side side : kSides) {
    for (const bool is_leg : {true, false}) {
      const Bone first = is_leg ? Bone::kLeftUpperLeg : Bone::kLeftShoulder;
      const auto bone = [&](std::size_t slot) {
        return on(side, static_cast<Bone>(static_cast<std::size_t>(first) + slot));
      };
      LimbJoints limb{};
      for (std::size_t i = 0; i < limb.size(); ++i) limb[i] = bones[bone(i)];
      settle_coincident(figure, names, is_leg, limb);
      for (std::size_t i = 0; i < limb.size(); ++i) bones.set(bone(i), limb[i]);
    }
  }
}

// Whether there is a person beside the one below `hips`, who was found by the shape or the names.
bool has_another(const Figure& figure, std::vector<JointName> names, int hips, bool by_shape) {
  SidesBy ignored{};
  if (by_shape) return limbs_by_shape(figure, names, ignored, hips).has_value();
  for (int j = 0; j < figure.size(); ++j) {
    if (figure.below(hips, j)) names[j] = {};
  }
  BoneJoints bones;
  find_limbs(figure, names, bones);
  return bones.has_limbs();
}

// A tree that begins at the head or the chest has the pelvis below the arms. Rotations of the trunk
// are then those of other segments than a bone's, which no profile can say either.
void note_root(const Figure& figure, const BoneJoints& bones, int chest,
               std::vector<std::string>& notes) {
  constexpr double kTrunk = 0.4;  // of a thigh; legs that begin as near have no trunk above them
  if (bones[Bone::kHips] != chest) return;
  const int pelvis = figure.common({bones[Bone::kLeftUpperLeg], bones[Bone::kRightUpperLeg]});
  const auto thigh = figure.between(bones[Bone::kLeftUpperLeg], bones[Bone::kLeftLowerLeg]);
  const auto trunk = figure.between(chest, pelvis);
  if (!thigh || !trunk || trunk->norm() <= kTrunk * thigh->norm()) return;
  notes.push_back("the tree does not begin at the hips: " + in_quotes(figure[pelvis].name) +
                  ", from which the legs begin, hangs below " + in_quotes(figure[chest].name) +
                  ", from which the arms begin and which counts as the hips; spine, neck and head "
                  "are not known: export the skeleton with its hips as root");
}

}  // namespace

Bone on(Side side, Bone left) {
  if (side == Side::kLeft) return left;
  const std::size_t step = left >= Bone::kLeftThumbMetacarpal ? kFingerBones : 4;
  return static_cast<Bone>(static_cast<std::size_t>(left) + step);
}

void BoneJoints::swap_sides(Bone first_left, int count) {
  for (int i = 0; i < count; ++i) {
    const auto left = static_cast<Bone>(static_cast<int>(first_left) + i);
    const Bone right = on(Side::kRight, left);
    std::swap(joint_[static_cast<std::size_t>(left)], joint_[static_cast<std::size_t>(right)]);
  }
}

bool BoneJoints::has_limbs() const {
  return std::ranges::all_of(kSides, [this](Side side) {
    return has(on(side, Bone::kLeftUpperLeg)) && has(on(side, Bone::kLeftLowerLeg)) &&
           has(on(side, Bone::kLeftUpperArm)) && has(on(side, Bone::kLeftLowerArm));
  });
}

std::vector<std::optional<Bone>> BoneJoints::by_joint(int joints) const {
  std::vector<std::optional<Bone>> out(joints);
  for (int b = 0; b < kBones; ++b) {
    if (const int joint = joint_[b]; joint >= 0) out[joint] = static_cast<Bone>(b);
  }
  return out;
}

void find_trunk(const Figure& figure, const std::vector<JointName>& names, BoneJoints& bones,
                std::vector<std::string>& notes) {
  const int chest = figure.common({bones[Bone::kLeftUpperArm], bones[Bone::kRightUpperArm]});
  int hips = figure.common({bones[Bone::kLeftUpperLeg], bones[Bone::kRightUpperLeg], chest});
  // 3ds Max may hang the legs on the spine; the pelvis is above it.
  for (int j = hips; is_trunk(names[hips]) && j >= 0; j = figure[j].parent) {
    if (is_pelvis(names[j])) hips = j;
  }
  bones.set(Bone::kHips, hips);
  note_root(figure, bones, chest, notes);
  const auto [head, top] = find_head(figure, names, bones, chest, notes);
  std::vector<int> trunk;
  std::vector<int> neck;
  for (const int j : figure.path(top)) {
    if (j == hips || !figure.below(hips, j)) continue;
    if (figure.below(j, chest)) {
      trunk.push_back(j);
    } else if (j != head) {
      neck.push_back(j);
    }
  }
  // Arms may begin at the neck, but a joint of that name is no trunk: some people have only that.
  while (!trunk.empty() && is_neck(names[trunk.back()])) {
    neck.insert(neck.begin(), trunk.back());
    trunk.pop_back();
  }
  drop_returns(figure, hips, trunk);
  keep_if_any(trunk, [&](int j) {
    // A root at the hips, or a piece of hips that are called so.
    const bool is_piece =
        names[hips].has("root") && names[j].stem != names[hips].stem && !is_trunk(names[j]);
    const bool is_root = names[j].has("root") && (is_piece || lies_at(figure, hips, j));
    return (j == chest || !names[j].helper) && !is_root;  // what turns both arms is a bone
  });
  keep_if_any(neck, [&names](int j) {
    return !names[j].helper || names[j].has("twist") || is_neck(names[j]);
  });
  // Above the arms, a joint named as trunk below one named neck belongs to the trunk.
  while (neck.size() > 1 && is_trunk(names[neck.front()]) &&
         std::any_of(neck.begin() + 1, neck.end(), [&](int j) { return is_neck(names[j]); })) {
    trunk.push_back(neck.front());
    neck.erase(neck.begin());
  }
  set_trunk(trunk, names, bones);
  if (!neck.empty()) bones.set(Bone::kNeck, neck.front());
  if (head >= 0) bones.set(Bone::kHead, head);
}

FoundBones find_bones(const Figure& figure, const std::vector<JointName>& names) {
  FoundBones out;
  find_limbs(figure, names, out.joint);
  const bool by_shape = !out.joint.has_limbs();
  if (!by_shape) settle_limbs(figure, names, out.joint);
  if (by_shape) {
    if (const auto hand = find_hand(figure, names, out.sides_by, out.notes)) {
      out.kind = Kind::kHand;
      out.joint = *hand;
      return out;
    }
    if (const auto limbs = limbs_by_shape(figure, names, out.sides_by)) out.joint = *limbs;
  }
  if (out.joint.has_limbs()) {
    out.kind = Kind::kPerson;
    find_trunk(figure, names, out.joint, out.notes);
    if (has_another(figure, names, out.joint[Bone::kHips], by_shape)) {
      out.notes.emplace_back("two persons are in it, or one twice: only the first is taken");
    }
  } else {
    find_parts(figure, names, out.joint);
  }
  for (const Side side : kSides) {
    if (!out.joint.has(on(side, Bone::kLeftHand))) continue;
    const FingersBy by = find_fingers(figure, names, side, out.joint);
    if (by == FingersBy::kNames) continue;
    const std::string hand = side == Side::kLeft ? "left hand" : "right hand";
    out.by_place[side == Side::kLeft ? 0 : 1] = by == FingersBy::kPlace;
    out.notes.push_back(by == FingersBy::kPlace
                            ? "fingers of the " + hand + " are known by their place only"
                            : "joints below the " + hand +
                                  " look like fingers, but neither names nor places say which: "
                                  "name them in a mapping (inspect --write)");
  }
  return out;
}

int sided_by_fingers(const Figure& figure, const Motion& motion, const BoneJoints& bones) {
  const auto at = [&](Bone left) { return bones[on(Side::kRight, left)]; };
  const int hand = at(Bone::kLeftHand);
  Vec curl = Vec::Zero();
  Vec along = Vec::Zero();
  std::vector<Vec> bases;
  for (int finger = 1; finger < kFingers; ++finger) {
    const auto first =
        static_cast<Bone>(static_cast<int>(Bone::kLeftThumbMetacarpal) + kFingerJoints * finger);
    const int base = at(first);
    const int next = at(static_cast<Bone>(static_cast<int>(first) + 1));
    if (base < 0 || next < 0) continue;
    const Vec way = direction(figure.between(base, next).value_or(Vec::Zero()));
    bases.push_back(figure.between(hand, base).value_or(Vec::Zero()));
    along += bases.back();
    for (int i = 0; i < motion.poses(); ++i) {
      curl += way.cross(motion.world(i, hand).transpose() * (motion.world(i, base) * way)) /
              motion.poses();
    }
  }
  if (bases.size() < 2 || !(along.norm() > 0.0)) return 0;
  const Vec to_index = direction(bases.front() - bases.back());
  const double bent = curl.dot(to_index) / static_cast<double>(bases.size());
  constexpr double kBent = 0.05;
  if (std::abs(bent) > kBent) return bent < 0.0 ? 1 : -1;
  const int thumb = at(Bone::kLeftThumbMetacarpal);
  if (thumb < 0) return 0;
  along /= static_cast<double>(bases.size());
  const Vec tip = figure.between(hand, figure.main_chain(thumb).back()).value_or(Vec::Zero());
  const double low = tip.dot(direction(along.cross(to_index))) / along.norm();
  constexpr double kLow = 0.1;
  return std::abs(low) < kLow ? 0 : low > 0.0 ? 1 : -1;
}

void swap_all_sides(BoneJoints& bones) {
  for (const auto& [first, count] : {std::pair{Bone::kLeftShoulder, 4},
                                     {Bone::kLeftUpperLeg, 4},
                                     {Bone::kLeftThumbMetacarpal, kFingerBones}}) {
    bones.swap_sides(first, count);
  }
}

bool turn_to_face(const Vec& facing, const Figure& figure, BoneJoints& bones) {
  const auto at = [&](Bone bone) { return figure.between(0, bones[bone]).value_or(Vec::Zero()); };
  const Vec left = at(Bone::kLeftUpperLeg) - at(Bone::kRightUpperLeg);
  const Vec up = at(Bone::kLeftUpperArm) + at(Bone::kRightUpperArm) - at(Bone::kLeftLowerLeg) -
                 at(Bone::kRightLowerLeg);
  if (left.cross(up).dot(facing) >= 0.0) return false;
  swap_all_sides(bones);
  return true;
}

}  // namespace posed::rig
