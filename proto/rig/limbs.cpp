#include <set>
#include <span>

#include "proto/rig/bones.hpp"
#include "proto/rig/cut.hpp"

namespace posed::rig {
namespace {

constexpr std::size_t kSlots = 4;

// The best choice of joints for the first slots of a limb along one path: slots in order, each at
// most once.
struct Choice {
  double value = -9.0;
  std::array<int, kSlots> joint{-1, -1, -1, -1};
};
using Choices = std::array<Choice, kSlots + 1>;  // [number of the last filled slot]

const Choice& best_of(std::span<const Choice> choices) {
  return *std::ranges::max_element(choices, {}, &Choice::value);
}

// `needed`: slots without which there is no limb; one filled counts 1 more.
void extend(Choices& choices, const Fit& fit, int joint, int rank,
            const std::array<bool, kSlots>& needed) {
  const Choices before = choices;
  for (std::size_t k = 0; k < kSlots; ++k) {
    if (fit[k] <= 0.0) continue;
    Choice choice = best_of(std::span(before).first(k + 1));
    choice.value += fit[k] + (needed[k] ? 1.0 : 0.0) - 1e-3 * rank;
    choice.joint[k] = joint;
    if (choice.value > choices[k + 1].value) choices[k + 1] = choice;
  }
}

// Of two joints that are called alike, a limb goes on in the one with more below it, or else in the
// farther one; the other helps the skin there. Of toes that are counted the first counts.
bool leads_on(const Figure& figure, const std::vector<JointName>& names, int joint, int before,
              bool are_toes) {
  const bool counted = names[joint].stem == names[before].stem && !names[joint].digits.empty() &&
                       !names[before].digits.empty();
  if (are_toes && counted && figure[joint].parent == figure[before].parent) {
    return names[joint].digits < names[before].digits;
  }
  const int more = figure.main_chain_length(joint) - figure.main_chain_length(before);
  if (more != 0 || figure[joint].parent != figure[before].parent) return more > 0;
  return figure[joint].offset.norm() > 1.01 * figure[before].offset.norm();
}

// For each name, whether it is another name with a number added: where there are "L_Arm" and
// "L_Arm2", the second one.
std::vector<bool> copies_in(const std::vector<JointName>& names) {
  std::set<std::pair<NameSide, std::string_view>> plain;
  for (const JointName& name : names) {
    if (name.digits.empty()) plain.emplace(name.side, name.stem);
  }
  std::vector<bool> out;
  out.reserve(names.size());
  for (const JointName& name : names) {
    out.push_back(!name.digits.empty() && plain.contains({name.side, name.stem}));
  }
  return out;
}

std::array<int, kSlots> best_chain(const Figure& figure, const std::vector<JointName>& names,
                                   const std::vector<std::optional<Fit>>& fits,
                                   const std::array<bool, kSlots>& needed, bool is_leg) {
  std::vector<Choices> at(fits.size());
  Choice best{.value = 0.0};
  int last = -1;
  for (int j = 0; j < figure.size(); ++j) {
    const int parent = figure[j].parent;
    if (parent >= 0) {
      at[j] = at[parent];
    } else {
      at[j][0].value = 0.0;
    }
    if (!fits[j]) continue;
    extend(at[j], *fits[j], j, figure.depth(j) - 1, needed);
    const Choice& top = best_of(at[j]);
    const double more = top.value - best.value;
    const bool is_toes = is_leg && top.joint.back() == j;
    if (more < -1e-9) continue;
    if (more <= 1e-9 && (last < 0 || !leads_on(figure, names, j, last, is_toes))) continue;
    best = top;
    last = j;
  }
  return best.joint;
}

// Some makers mark an elbow or a knee by a joint beside the hand or the foot, which is slot `end`.
// With nothing below it, it would end the limb before that: it is no part of it.
void drop_marks(const Figure& figure, std::size_t end, std::vector<std::optional<Fit>>& fits) {
  std::vector<bool> leads(fits.size());  // [joint] whether a hand or a foot is below it
  for (int j = figure.size() - 1; j > 0; --j) {
    const int parent = figure[j].parent;
    if (parent >= 0 && (leads[j] || (fits[j] && (*fits[j])[end] > 0.0))) leads[parent] = true;
  }
  for (int j = 1; j < figure.size(); ++j) {
    const int parent = figure[j].parent;
    if (!fits[j] || parent < 0 || !fits[parent] || !leads[parent]) continue;
    const bool is_end = (*fits[j])[end] > 0.0 || fits[j]->back() > 0.0;
    if (figure.children(j).empty() && !is_end) fits[j].reset();
  }
}

// A hand or a foot that the names do not say is the next joint of the limb, where that is far
// enough to be no twist: `chain` ends before it. Some makers cut a segment into pieces of one name.
int next_of_limb(const Figure& figure, const std::vector<JointName>& names, int last, int known) {
  constexpr double kFar = 0.5;  // of the segment before
  const auto piece_below = [&](int joint) {
    const auto& below = figure.children(joint);
    const auto at = std::ranges::find(below, names[last].words,
                                      [&names](int child) { return names[child].words; });
    return at == below.end() ? -1 : *at;
  };
  int piece = last;
  for (int below = piece_below(piece); below >= 0; below = piece_below(piece)) piece = below;
  int next = -1;
  for (const int child : figure.children(piece)) {
    const bool leads = known < 0 || (child != known && figure.below(child, known));
    const double way = figure.between(last, child).value_or(Vec::Zero()).norm();
    const bool far = way > kFar * figure[last].offset.norm();
    if (!leads || !far || names[child].helper || finger_of(names[child])) continue;
    if (next >= 0) return -1;
    next = child;
  }
  return next;
}

// Toes that no word names are the one joint that the foot holds, as far away as toes are. A joint
// with the foot's name and more is a point of the foot.
int toes_of(const Figure& figure, const std::vector<JointName>& names, int foot) {
  const double shin = figure[foot].offset.norm();
  int toes = -1;
  for (const int child : figure.children(foot)) {
    const double way = figure[child].offset.norm();
    const bool likely = way > 0.15 * shin && way < 0.8 * shin && !names[child].helper &&
                        !names[child].stem.starts_with(names[foot].stem);
    if (!likely) continue;
    if (toes >= 0) return -1;
    toes = child;
  }
  return toes;
}

// Of makers that call the ankle by its name, the "foot" below it is the ball, where the toes begin,
// and "toe" is their tip.
int ball_of_foot(const Figure& figure, const std::vector<std::optional<Fit>>& fits, int ankle,
                 int toes) {
  constexpr double kAtAnkle = 0.2;  // of the foot's length: a second joint there is no ball
  const double length = figure.between(ankle, toes).value_or(Vec::Zero()).norm();
  for (int j = figure[toes].parent; j != ankle; j = figure[j].parent) {
    const bool is_foot = fits[j] && (*fits[j])[2] >= 0.9;  // by its whole name
    const Vec way = figure.between(ankle, j).value_or(Vec::Zero());
    if (is_foot && way.norm() > kAtAnkle * length) return j;
  }
  return toes;
}

// The joint between the trunk and an upper arm that no word names is the shoulder, if there is one.
int shoulder_of(const Figure& figure, const std::vector<JointName>& names, int chest, int arm) {
  int found = -1;
  for (int j = figure[arm].parent; j > chest; j = figure[j].parent) {
    if (names[j].helper || figure.between(j, arm).value_or(Vec::Zero()).isZero()) continue;
    if (found >= 0) return -1;
    found = j;
  }
  return found;
}

// The pieces of a limb that its maker tells apart by numbers only, from `first` on, and what ends
// them: a joint with their name and "end", else `end` if it is not -1.
struct Pieces {
  std::vector<int> joint;
  bool has_end = false;  // the last joint is where the limb ends, and no piece

  [[nodiscard]] std::size_t size() const { return joint.size(); }
};

Pieces pieces_of(const Figure& figure, const std::vector<JointName>& names, int first, int end) {
  Pieces out;
  const auto below = [&](int joint, const std::string& stem) {
    const auto& children = figure.children(joint);
    const auto at = std::ranges::find_if(children, [&](int child) {
      return names[child].stem == stem && names[child].side == names[first].side;
    });
    return at == children.end() ? -1 : *at;
  };
  for (int joint = first; joint >= 0; joint = below(joint, names[first].stem)) {
    out.joint.push_back(joint);
  }
  const int last = out.joint.back();
  const int named = below(last, names[first].stem + "end");
  if (named >= 0) end = named;
  out.has_end = end >= 0 && end != last && figure.below(last, end);
  if (out.has_end) out.joint.push_back(end);
  return out;
}

// Where names say no more of a limb than its pieces, their lengths tell the bones. `upper` is the
// upper one's place in the chain; `leg` the length of a leg's bones, if it is known.
void settle_pieces(const Figure& figure, const std::vector<JointName>& names, std::size_t upper,
                   double leg, std::array<int, kSlots>& chain) {
  const int first = chain[upper];
  const int lower = chain[upper + 1];
  if (first < 0 || lower < 0 || names[first].stem != names[lower].stem) return;
  const int known = chain[upper + 2];
  auto pieces = pieces_of(figure, names, first, known);
  if (!pieces.has_end) {
    const int next = next_of_limb(figure, names, pieces.joint.back(), -1);
    if (next >= 0) pieces.joint.push_back(next);
  }
  const bool is_leg = upper == 0;
  const CutLimb limb(figure, pieces.joint, pieces.has_end);
  const auto cut = is_leg ? limb.as_leg() : limb.as_arm(leg);
  if (!cut) return;
  const int end = pieces.joint[cut->end];
  chain[upper] = pieces.joint[cut->begin];
  chain[upper + 1] = pieces.joint[cut->bend];
  chain[upper + 2] = end;
  if (!is_leg || chain[3] >= 0) return;
  // What was called the foot is the ball of one that ends the leg.
  if (known >= 0 && known != end && figure.below(end, known)) chain[3] = known;
  if (chain[3] < 0 && cut->end + 1 < pieces.size()) chain[3] = pieces.joint[cut->end + 1];
}

}  // namespace

void find_limbs(const Figure& figure, const std::vector<JointName>& names, BoneJoints& bones) {
  const auto copies = copies_in(names);
  double leg = 0.0;
  const auto find = [&](Side side, Bone first, auto fit_of,
                        const std::array<bool, kSlots>& needed) {
    const NameSide wanted = side == Side::kLeft ? NameSide::kLeft : NameSide::kRight;
    std::vector<std::optional<Fit>> fits(names.size());
    for (std::size_t j = 0; j < names.size(); ++j) {
      if (names[j].side == wanted) fits[j] = fit_of(names[j]);
      // Of two that fit alike the one without a number is taken, even if it is deeper in the tree.
      constexpr double kCopy = 0.99;
      if (fits[j] && copies[j]) {
        for (double& fit : *fits[j]) fit *= kCopy;
      }
    }
    const std::size_t end = first == Bone::kLeftUpperLeg ? 2 : 3;  // foot or hand
    drop_marks(figure, end, fits);
    auto chain = best_chain(figure, names, fits, needed, end == 2);
    settle_pieces(figure, names, first == Bone::kLeftUpperLeg ? 0 : 1, leg, chain);
    if (chain[end - 1] >= 0 && chain[end] < 0) {
      chain[end] = next_of_limb(figure, names, chain[end - 1], end == 2 ? chain[3] : -1);
    }
    if (end == 2 && chain[2] >= 0) {
      chain[3] = chain[3] < 0 ? toes_of(figure, names, chain[2])
                              : ball_of_foot(figure, fits, chain[2], chain[3]);
    }
    if (end == 2 && *std::ranges::min_element(std::span(chain).first(3)) >= 0) {
      leg = figure.between(chain[0], chain[1]).value_or(Vec::Zero()).norm() +
            figure.between(chain[1], chain[2]).value_or(Vec::Zero()).norm();
    }
    for (std::size_t k = 0; k < kSlots; ++k) {
      bones.set(on(side, static_cast<Bone>(static_cast<std::size_t>(first) + k)), chain[k]);
    }
  };
  for (const Side side : kSides) {
    find(side, Bone::kLeftUpperLeg, leg_fit, {true, true, false, false});
    find(side, Bone::kLeftShoulder, arm_fit, {false, true, true, false});
  }
  if (!bones.has_limbs()) return;
  const int chest = figure.common({bones[Bone::kLeftUpperArm], bones[Bone::kRightUpperArm]});
  for (const Side side : kSides) {
    const Bone shoulder = on(side, Bone::kLeftShoulder);
    const bool carries_both = bones.has(shoulder) && figure.below(bones[shoulder], chest);
    if (bones.has(shoulder) && !carries_both) continue;
    bones.set(shoulder, shoulder_of(figure, names, chest, bones[on(side, Bone::kLeftUpperArm)]));
  }
}

}  // namespace posed::rig
