#include "proto/rig/recognise.hpp"

#include <cmath>
#include <utility>

#include "proto/rig/borrow.hpp"
#include "proto/text/lower.hpp"

namespace posed::rig {
namespace {

constexpr double kAdultLeg_m = 0.82;    // thigh and shin
constexpr double kAdultTrunk_m = 0.48;  // hips to the middle of the shoulders
constexpr double kAdultHand_m = 0.18;   // wrist to the tip of the middle finger
constexpr double kMaxLength = 1e9;

struct LengthUnit {
  double metres;
  std::string_view name;
  double doubt;              // how much worse the fit of a more usual unit may be
  double named_doubt = 0.0;  // the same, where the names are those of its maker
};
constexpr double kInch_m = 0.0254;
constexpr double kCmu_m = kInch_m / 0.45;
constexpr double kMmd_m = 0.08;
constexpr double kPoser_m = 2.4384;
constexpr double kNever = 1e9;  // unless its maker's names say so: a usual unit is too near
constexpr double kHundred = 100.0;
constexpr std::array<LengthUnit, 10> kLengthUnits{
    {{1.0, "metres", 0.0},
     {0.01, "centimetres", 0.0},
     {0.001, "millimetres", 0.1},
     {kInch_m, "inches", 0.5},
     {0.1, "decimetres", 0.3},
     {0.3048, "feet", 0.35},
     {kCmu_m, "inches / 0.45", 0.6},
     {kPoser_m, "Poser's units of 8 feet", kNever, 0.6},  // others write such names too
     {kMmd_m, "MikuMikuDance's units of 8 cm", kNever},
     {kHundred, "metres that the file calls centimetres", kNever}}};

// The unit of makers that have one of their own, known by names that only they give; else 0.
double usual_unit_m(const std::vector<RigJoint>& joints, const std::vector<JointName>& names) {
  const auto any_name = [&names](std::string_view part) {
    return std::ranges::any_of(names,
                               [part](const JointName& name) { return name.stem.contains(part); });
  };
  const auto any_joint = [&joints](std::string_view part) {
    return std::ranges::any_of(
        joints, [part](const RigJoint& joint) { return lower(joint.name).contains(part); });
  };
  const bool is_mmd = (any_name("upperbody") && any_name("lowerbody")) || any_joint("センター");
  return is_mmd                    ? kMmd_m
         : any_joint("hipjoint")   ? kCmu_m
         : any_joint("valvebiped") ? kInch_m
         : any_joint("shldr")      ? kPoser_m
                                   : 0.0;
}

const LengthUnit& unit_for(double length, double true_m, double usual_m) {
  return *std::ranges::min_element(kLengthUnits, {}, [&](const LengthUnit& unit) {
    const double doubt = unit.metres == usual_m ? unit.named_doubt : unit.doubt;
    return std::abs(std::log(length * unit.metres / true_m)) + doubt;
  });
}

// How long thigh and shin would be if the person had an adult's proportions. Children and toons,
// whose legs are short for their trunks, are else taken for tall people in inches.
double adult_leg(const Figure& figure, const BoneJoints& joint, double leg) {
  const auto left = figure.between(joint[Bone::kHips], joint[Bone::kLeftUpperArm]);
  const auto right = figure.between(joint[Bone::kHips], joint[Bone::kRightUpperArm]);
  if (!left || !right) return leg;
  const double trunk = (*left + *right).norm() / 2.0 * kAdultLeg_m / kAdultTrunk_m;
  constexpr double kMaxRatio = 2.0;  // beyond it the hips are somewhere else
  return trunk > leg / kMaxRatio && trunk < leg * kMaxRatio ? std::sqrt(leg * trunk) : leg;
}

// Whether it may be metres: those of children, giants and toys are.
bool may_be_metres(double length, double true_m) {
  constexpr double kToo = 8.0;
  return length * kToo > true_m && length < kToo * true_m;
}

// `likened`: the length in a figure of an adult's proportions.
void set_unit(double length, double likened, double true_m, double usual_m, std::string_view what,
              const RigInput& input, Rig& rig) {
  if (!(length > 0.0)) return;
  if (input.format_says && !rig.metres_per_unit && may_be_metres(length, true_m)) {
    rig.metres_per_unit = 1.0;
  }
  // A figure as small as a thumb is the usual mistake of a format that has a unit.
  if (input.format_says && length < true_m && !may_be_metres(length, true_m)) usual_m = kHundred;
  const LengthUnit& unit = unit_for(likened, true_m, usual_m);
  if (!rig.metres_per_unit) {
    rig.metres_per_unit = unit.metres;
    rig.unit = unit.name;
  }
  const double length_m = length * *rig.metres_per_unit;
  rig.why_unit = std::string(what) + ' ' + short_text(length_m, 2) + " m long";
  const bool likely = length_m > 0.73 * true_m && length_m < 1.34 * true_m;
  if (rig.kind == Kind::kPerson && !likely) {
    rig.notes.push_back(rig.why_unit + ": is the unit of length right?");
  }
}

bool is_sane(const std::vector<RigJoint>& joints) {
  const auto sane = [](const Vec& v) {
    return v.allFinite() && v.cwiseAbs().maxCoeff() < kMaxLength;
  };
  return !joints.empty() && std::ranges::all_of(joints, [&sane](const RigJoint& joint) {
    return sane(joint.offset) && (!joint.end_site || sane(*joint.end_site));
  });
}

std::vector<std::string_view> names_of(const std::vector<RigJoint>& joints) {
  std::vector<std::string_view> names;
  names.reserve(joints.size());
  for (const RigJoint& joint : joints) names.push_back(joint.name);
  return names;
}

FoundBones known_bones(const std::vector<std::optional<Bone>>& bones) {
  FoundBones out;
  for (std::size_t j = 0; j < bones.size(); ++j) {
    if (bones[j]) out.joint.set(*bones[j], static_cast<int>(j));
  }
  const bool has_hand = out.joint.has(Bone::kLeftHand) || out.joint.has(Bone::kRightHand);
  if (out.joint.has_limbs()) {
    out.kind = Kind::kPerson;
  } else if (has_hand && !out.joint.has(Bone::kHips)) {
    out.kind = Kind::kHand;
  }
  return out;
}

Eigen::Quaterniond rotation_of(const Mat& m) {
  if (!m.allFinite()) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(m).normalized();
}

// Joints that are no bones go with their parent; those above the hips go with the hips.
void collect(const RigInput& input, const Frames& frames, Rig& rig) {
  const auto& hips = frames.t_frame(Bone::kHips);
  for (std::size_t j = 0; j < input.joints.size(); ++j) {
    const int parent = input.joints[j].parent;
    Eigen::Quaterniond T = parent >= 0 ? rig.T[parent]
                           : hips      ? rotation_of(*hips)
                                       : Eigen::Quaterniond::Identity();
    if (rig.bone[j]) {
      if (const auto& found = frames.t_frame(*rig.bone[j])) T = rotation_of(*found);
      rig.evidence[j] = frames.evidence(*rig.bone[j]);
    }
    if (j < input.T.size() && input.T[j]) {
      T = *input.T[j];
      rig.evidence[j] = {1.0, "the file or a profile says so"};
    }
    rig.T[j] = T;
  }
}

// Nothing is sure of a person who may as well face the other way, and what is known of a finger is
// no surer than which finger it is.
void doubt_places(const FoundBones& found, const RigInput& input, Rig& rig) {
  constexpr double kGuess = 0.4;
  if (found.kind == Kind::kPerson && found.sides_by == SidesBy::kNothing && !input.facing) {
    for (std::size_t j = 0; j < rig.bone.size(); ++j) {
      Evidence& evidence = rig.evidence[j];
      if (!rig.bone[j] || evidence.sure <= kGuess) continue;
      evidence = {.sure = kGuess, .why = "where it faces is a guess; " + evidence.why};
    }
  }
  constexpr double kByPlace = 0.7;
  for (std::size_t j = 0; j < rig.bone.size(); ++j) {
    if (!rig.bone[j] || *rig.bone[j] < Bone::kLeftThumbMetacarpal) continue;
    const bool left = *rig.bone[j] < on(Side::kRight, Bone::kLeftThumbMetacarpal);
    Evidence& evidence = rig.evidence[j];
    if (!found.by_place[left ? 0 : 1] || evidence.sure < kByPlace) continue;
    evidence = {.sure = kByPlace, .why = "a finger by its place in the hand; " + evidence.why};
  }
}

// Knees and elbows bend one way: where neither names nor feet say which side of a person is left,
// they do. What the names say of one limb they do not undo.
void side_by_bends(const Figure& figure, const std::vector<JointName>& names, const Motion& motion,
                   FoundBones& found) {
  if (has_named_sides(names, found.joint)) return;
  std::vector<std::string> notes;  // of an attempt, which nobody reads
  Frames frames(figure, names, found.joint, motion, notes);
  if (!frames.can_find_person()) return;
  frames.find_person();
  const int ahead = frames.bends_ahead();
  if (ahead < 0) swap_all_sides(found.joint);
  if (ahead != 0) found.sides_by = SidesBy::kBends;
}

// Which side of the person is left, and so where it faces: by the caller's word, the names, the
// feet or how it bends.
void settle_facing(const RigInput& input, const Figure& figure, FoundBones& found, Rig& rig) {
  const bool by_profile = !input.bones.empty();
  if (input.facing && !by_profile) {
    const bool turned = turn_to_face(*input.facing, figure, found.joint);
    if (turned && found.sides_by == SidesBy::kNames) {
      found.notes.emplace_back("left and right are not as the names say, so that it faces " +
                               std::string(axis_text(*input.facing)));
    }
  } else if (found.sides_by == SidesBy::kFeet) {
    found.notes.emplace_back(
        "bones are known by shape only; left and right by the direction of the feet");
  } else if (found.sides_by == SidesBy::kBends) {
    found.notes.emplace_back(
        "bones are known by shape only; left and right by how knees and elbows bend in the clip");
  } else if (found.sides_by == SidesBy::kNothing) {
    found.notes.emplace_back(
        "which side is left is not known: neither names, feet nor bends say it of all limbs; say "
        "which axis the zero pose faces (facing)");
  }
  rig.why_facing = by_profile                          ? "by the bones of the profile"
                   : input.facing                      ? "as you say"
                   : found.sides_by == SidesBy::kNames ? "by the names of left and right"
                   : found.sides_by == SidesBy::kFeet  ? "by the feet"
                   : found.sides_by == SidesBy::kBends ? "by how knees and elbows bend"
                                                       : "a guess";
}

// Which hand it is where no name says it.
void settle_hand(const Figure& figure, const Motion& motion, FoundBones& found) {
  const int sided = sided_by_fingers(figure, motion, found.joint);
  if (sided > 0) {
    found.joint.swap_sides(Bone::kLeftShoulder, 4);
    found.joint.swap_sides(Bone::kLeftThumbMetacarpal, kFingers * kFingerJoints);
  }
  found.notes.emplace_back(
      sided > 0   ? "a left hand by its fingers; no name says it"
      : sided < 0 ? "a right hand by its fingers; no name says it"
                  : "which hand it is is not known: neither names nor fingers say it; taken for a "
                    "right one");
}

// The axis that the zero pose faces, from the T frame of its hips.
void set_facing(const RigInput& input, const Frames& frames, Rig& rig) {
  const auto& hips = frames.t_frame(Bone::kHips);
  if (!hips) return;
  rig.facing = axis_text(hips->transpose() * kZ);
  if (input.facing && rig.facing != axis_text(*input.facing)) {
    rig.notes.push_back("the zero pose faces " + rig.facing + ", not " +
                        std::string(axis_text(*input.facing)) + " as was said");
  }
}

bool knows_all_frames(const RigInput& input, const std::vector<std::optional<Bone>>& bones) {
  if (input.T.size() < bones.size()) return false;
  for (std::size_t j = 0; j < bones.size(); ++j) {
    if (bones[j] && !input.T[j]) return false;
  }
  return true;
}

Rig empty_rig(const RigInput& input) {
  Rig rig;
  rig.bone.resize(input.joints.size());
  rig.T.resize(input.joints.size(), Eigen::Quaterniond::Identity());
  rig.evidence.resize(input.joints.size());
  rig.metres_per_unit = input.metres_per_unit;
  return rig;
}

// What is recognised of a figure whose bones are found.
Rig recognise_found(const RigInput& input, const Figure& figure,
                    const std::vector<JointName>& names, FoundBones found) {
  Rig rig = empty_rig(input);
  const Motion motion(figure, input.poses);
  if (found.kind == Kind::kPerson && input.bones.empty() &&
      is_animal(figure, motion, found.joint)) {
    found = {};
    found.notes.emplace_back("it stands on four legs: an animal, of which no bone is a person's");
  }
  if (found.kind == Kind::kHand && found.sides_by == SidesBy::kNothing) {
    settle_hand(figure, motion, found);
  }
  rig.kind = found.kind;
  const bool is_asked = found.sides_by == SidesBy::kNothing && !input.facing;
  if (found.kind == Kind::kPerson && is_asked) side_by_bends(figure, names, motion, found);
  if (found.kind == Kind::kPerson) settle_facing(input, figure, found, rig);
  rig.bone = found.joint.by_joint(figure.size());
  std::vector<std::string> notes = found.notes;
  Frames frames(figure, names, found.joint, motion, notes);
  for (std::size_t j = 0; j < std::min(input.T.size(), rig.bone.size()); ++j) {
    if (rig.bone[j] && input.T[j]) frames.know(*rig.bone[j], input.T[j]->toRotationMatrix());
  }
  if (found.kind == Kind::kPerson && frames.can_find_person()) {
    frames.find_person();
    set_facing(input, frames, rig);
    const double leg = frames.leg_length();
    set_unit(leg, adult_leg(figure, found.joint, leg), kAdultLeg_m,
             usual_unit_m(input.joints, names), "thigh and shin are", input, rig);
  } else if (found.kind == Kind::kHand) {
    const Side side = found.joint.has(Bone::kLeftHand) ? Side::kLeft : Side::kRight;
    frames.find_hand(side);
    const double hand = frames.hand_length(side);
    set_unit(hand, hand, kAdultHand_m, 0.0, "the hand is", input, rig);
  } else {
    rig.kind = Kind::kPart;
    frames.lay_parts();
  }
  const bool by_format = input.format_says && !frames.up_by_zero_pose();
  rig.up = input.up.value_or(by_format ? UpAxis::kPlusY : frames.up());
  if (!input.up && !by_format && !frames.up_doubt().empty()) notes.push_back(frames.up_doubt());
  rig.why_up = by_format && !input.up ? "as the format says" : frames.why_up();
  if (!knows_all_frames(input, rig.bone)) {
    rig.notes.insert(rig.notes.begin(), notes.begin(), notes.end());
  }
  collect(input, frames, rig);
  doubt_places(found, input, rig);
  return rig;
}

}  // namespace

Rig recognise(const RigInput& input) {
  if (!is_sane(input.joints)) return empty_rig(input);
  const Figure figure(input.joints);
  const auto names = parse_names(names_of(input.joints));
  FoundBones found = input.bones.empty() ? find_bones(figure, names) : known_bones(input.bones);
  const auto whole = found.kind == Kind::kPart && input.bones.empty()
                         ? with_borrowed_limbs(input, figure, names, found.joint)
                         : std::nullopt;
  if (!whole) return recognise_found(input, figure, names, std::move(found));
  const Figure person(whole->input.joints);
  FoundBones bones = find_bones(person, whole->names);
  if (bones.kind != Kind::kPerson) return recognise_found(input, figure, names, std::move(found));
  bones.notes.insert(bones.notes.begin(), whole->notes.begin(), whole->notes.end());
  Rig rig = recognise_found(whole->input, person, whole->names, std::move(bones));
  rig.bone.resize(input.joints.size());
  rig.T.resize(input.joints.size());
  rig.evidence.resize(input.joints.size());
  return rig;
}

}  // namespace posed::rig
