#include <cmath>
#include <span>

#include "proto/rig/bones.hpp"
#include "proto/rig/cut.hpp"

namespace posed::rig {
namespace {

constexpr std::size_t kMaxPairs = 400;  // the longest; a person has a dozen
constexpr std::size_t kMaxSiblings = 64;
constexpr std::size_t kLimbJoints = 4;

constexpr std::array kLeg{Bone::kLeftUpperLeg, Bone::kLeftLowerLeg, Bone::kLeftFoot,
                          Bone::kLeftToes};
constexpr std::array kArm{Bone::kLeftShoulder, Bone::kLeftUpperArm, Bone::kLeftLowerArm,
                          Bone::kLeftHand};

constexpr double kTrunkOfLeg = 0.45;  // from where the legs begin to where the arms do

// Two chains that begin at one joint and are as long as each other, as far as a limb goes.
struct Pair {
  double length = 0.0;
  int parent = 0;
  int one = 0, other = 0;  // where the chains begin
  std::array<std::vector<int>, 2> chain;
  CutLimb limb;
  TwoBones as_leg;
};

Vec way_to_tip(const Figure& figure, int from, const std::vector<int>& chain) {
  return figure.between(from, chain.back()).value_or(Vec::Zero()) +
         figure[chain.back()].end_site.value_or(Vec::Zero());
}

// The chains below a joint that spreads them as a palm its fingers: four to six of a few joints
// each, which do not split, are not far from as long as each other, and lead the same way.
std::vector<std::vector<int>> spread_at(const Figure& figure, int palm) {
  constexpr std::size_t kMaxChains = 6;
  constexpr int kMaxLinks = 5;  // a bone in the palm, and a tip
  constexpr double kApart_deg = 100;
  const auto& children = figure.children(palm);
  std::vector<std::vector<int>> chains;
  std::vector<Vec> ways;
  if (children.size() < 4 || children.size() > kMaxChains) return chains;
  for (const int child : children) {
    const int joints = figure.main_chain_length(child);
    if (joints < 2 || joints > kMaxLinks) return {};
    chains.push_back(figure.main_chain(child));
    const bool splits = std::ranges::any_of(
        chains.back(), [&figure](int joint) { return figure.children(joint).size() > 1; });
    if (splits) return {};
    ways.push_back(way_to_tip(figure, palm, chains.back()));
  }
  for (const Vec& a : ways) {
    for (const Vec& b : ways) {
      if (angle_deg(a, b) > kApart_deg || a.norm() > 3 * b.norm()) return {};
    }
  }
  return chains;
}

// The joint of a limb's chain that spreads fingers; -1 where none does.
int palm_of(const Figure& figure, const std::vector<int>& chain) {
  const auto palm =
      std::ranges::find_if(chain, [&](int joint) { return !spread_at(figure, joint).empty(); });
  return palm == chain.end() ? -1 : *palm;
}

// The joints of two limbs that have one another's length, side by side: an arm may hold a shield,
// or a hand a weapon.
std::array<std::vector<int>, 2> side_by_side(const Figure& figure, int one, int other) {
  constexpr double kDiffer = 0.15;
  constexpr std::size_t kMaxJoints = 16;
  std::array<std::vector<int>, 2> chains;
  while (one >= 0 && other >= 0 && chains[0].size() < kMaxJoints) {
    chains[0].push_back(one);
    chains[1].push_back(other);
    const std::span<const int> mine = figure.children(one);
    const std::span<const int> theirs = figure.children(other);
    const bool is_whole = chains[0].size() >= kLimbJoints;
    one = is_whole ? -1 : figure.main_child(one);
    other = is_whole ? -1 : figure.main_child(other);
    double farthest = -1.0;
    for (const int a : mine.first(std::min(mine.size(), kMaxSiblings))) {
      for (const int b : theirs.first(std::min(theirs.size(), kMaxSiblings))) {
        const double length = figure[a].offset.norm();
        const double their = figure[b].offset.norm();
        const double way = std::min(length + figure.reach(a), their + figure.reach(b));
        if (std::abs(length - their) > kDiffer * std::max(length, their) || way <= farthest) {
          continue;
        }
        farthest = way;
        one = a;
        other = b;
      }
    }
  }
  return chains;
}

std::optional<Pair> mirrored(const Figure& figure, int parent, int one, int other) {
  const int joints = figure.main_chain_length(one);
  const int others = figure.main_chain_length(other);
  if (std::min(joints, others) < 3) return std::nullopt;
  auto chains = side_by_side(figure, one, other);
  const std::size_t count = chains[0].size();
  if (count < 3 || (count < kLimbJoints && joints != others)) return std::nullopt;
  double length = 0.0;
  double gap = 0.0;
  const auto compare = [&](double a, double b) {
    length += a;
    gap += std::abs(a - b);
  };
  for (std::size_t i = 1; i < std::min(count, kLimbJoints + 1); ++i) {
    compare(figure[chains[0][i]].offset.norm(), figure[chains[1][i]].offset.norm());
  }
  if (count <= kLimbJoints && joints == others) {
    compare(figure.end_length(chains[0].back()), figure.end_length(chains[1].back()));
  }
  const double apart = std::abs(figure[one].offset.norm() - figure[other].offset.norm());
  if (!(length > 0.0) || gap >= 0.15 * length || apart >= 0.15 * length) return std::nullopt;
  CutLimb limb(figure, chains, palm_of(figure, chains[0]));
  const auto leg = limb.as_leg();
  if (!leg) return std::nullopt;
  return Pair{.length = length,
              .parent = parent,
              .one = one,
              .other = other,
              .chain = std::move(chains),
              .limb = std::move(limb),
              .as_leg = *leg};
}

std::vector<Pair> find_pairs(const Figure& figure) {
  std::vector<Pair> pairs;
  for (int j = 0; j < figure.size(); ++j) {
    const auto& children = figure.children(j);
    const std::size_t count = std::min(children.size(), kMaxSiblings);
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        auto pair = mirrored(figure, j, children[a], children[b]);
        if (pair) pairs.push_back(std::move(*pair));
      }
    }
  }
  if (pairs.size() > kMaxPairs) {
    std::ranges::stable_sort(pairs, std::greater{}, &Pair::length);
    pairs.erase(pairs.begin() + kMaxPairs, pairs.end());
  }
  return pairs;
}

// Where arms bend, if legs and arms are one body's: they hang on one trunk, none in another. The
// joint of the legs is above that of the arms, or each is on a branch of its own. Fingers of two
// hands are no limbs.
std::optional<TwoBones> fit_together(const Figure& figure, const Pair& legs, const Pair& arms) {
  const auto in = [&figure](const Pair& pair, int joint) {
    return figure.below(pair.one, joint) || figure.below(pair.other, joint);
  };
  const bool overlap = in(arms, legs.one) || in(arms, legs.other);
  const bool one_trunk =
      figure.below(legs.parent, arms.parent) || !figure.below(arms.parent, legs.parent);
  const bool are_fingers =
      !spread_at(figure, legs.parent).empty() && !spread_at(figure, arms.parent).empty();
  if (!one_trunk || in(legs, arms.parent) || in(arms, legs.parent) || overlap || are_fingers) {
    return std::nullopt;
  }
  const double leg = legs.as_leg.length;
  const auto arm = arms.limb.as_arm(leg);
  if (!arm || arm->length < 0.4 * leg || arm->length > 1.5 * leg) return std::nullopt;
  return arm;
}

// Number of joints from where the legs' branch leaves the trunk of the arms to the legs.
int branched_off(const Figure& figure, const Pair& legs, const Pair& arms) {
  return figure.depth(legs.parent) - figure.depth(figure.common({legs.parent, arms.parent}));
}

// How well two pairs of limbs are a person's: the longer legs, the better, but wings, hair, capes
// and skirts are of other sizes than arms, or begin elsewhere.
double person_score(const Figure& figure, const Pair& legs, const Pair& arms,
                    const TwoBones& as_arm) {
  constexpr double kArmsDiffer = 0.15;
  constexpr double kTrunksDiffer = 0.7;
  const int common = figure.common({legs.parent, arms.parent});
  const Vec trunk = figure.between(common, arms.parent).value_or(Vec::Zero()) -
                    figure.between(common, legs.parent).value_or(Vec::Zero());
  const double leg = legs.as_leg.length;
  const double arm = std::max(0.0, unlike(as_arm.length, kArmOfLeg * leg) - kArmsDiffer);
  const double body = std::clamp(unlike(trunk.norm(), kTrunkOfLeg * leg) - kTrunksDiffer, 0.0, 1.0);
  const double off = 0.3 * branched_off(figure, legs, arms) + 1e-3 * figure.depth(legs.parent);
  return leg * std::exp(-(arm + body + off));
}

void set_limb(const Pair& pair, bool arm, const TwoBones& two, BoneJoints& bones) {
  const std::array<std::size_t, 4> at =  // wraps where an arm has no clavicle
      arm ? std::array{two.begin - 1, two.begin, two.bend, two.end}
          : std::array{two.begin, two.bend, two.end, two.end + 1};
  for (const Side side : kSides) {
    const auto& chain = pair.chain[side == Side::kLeft ? 0 : 1];
    for (std::size_t k = 0; k < at.size(); ++k) {
      if (at[k] < chain.size()) bones.set(on(side, arm ? kArm[k] : kLeg[k]), chain[at[k]]);
    }
  }
}

// Above 0 where the names say that `bones` has a limb's sides right, below 0 where they say that it
// has them wrong.
int votes_by_name(const std::vector<JointName>& names, const BoneJoints& bones,
                  const std::array<Bone, 4>& limb) {
  int votes = 0;
  for (const Side side : kSides) {
    for (const Bone bone : limb) {
      const int joint = bones[on(side, bone)];
      if (joint >= 0) votes += static_cast<int>(names[joint].side) * (side == Side::kLeft ? 1 : -1);
    }
  }
  return votes;
}

// Whether `bones` has a limb's sides right: by its names, else by the line from right to left.
bool sides_are_right(const std::vector<JointName>& names, const BoneJoints& bones,
                     const std::array<Bone, 4>& limb, const Vec& line, const Vec& left, bool sure,
                     SidesBy& sides_by) {
  const int votes = votes_by_name(names, bones, limb);
  if (votes != 0) return votes > 0;
  const bool unclear =
      !sure || line.norm() < 1e-9 || std::abs(direction(line).dot(direction(left))) < 0.5;
  if (unclear) sides_by = SidesBy::kNothing;
  if (sides_by == SidesBy::kNames) sides_by = SidesBy::kFeet;
  return line.dot(left) >= 0.0;
}

void settle_sides(const Figure& figure, const std::vector<JointName>& names, BoneJoints& bones,
                  SidesBy& sides_by) {
  std::vector<int> all;
  for (int b = 0; b < kBones; ++b) {
    if (bones.has(static_cast<Bone>(b))) all.push_back(bones[static_cast<Bone>(b)]);
  }
  const int hips = figure.common(all);
  const auto at = [&](Side side, Bone bone) {
    return figure.between(hips, bones[on(side, bone)]).value_or(Vec::Zero());
  };
  Vec ahead = Vec::Zero();
  Vec up = Vec::Zero();
  for (const Side side : kSides) {
    const Bone foot = bones.has(on(side, Bone::kLeftFoot)) ? Bone::kLeftFoot : Bone::kLeftLowerLeg;
    const int toes = bones[on(side, Bone::kLeftToes)];
    ahead += toes >= 0 ? figure[toes].offset
                       : figure[bones[on(side, foot)]].end_site.value_or(Vec::Zero());
    up += at(side, Bone::kLeftUpperArm) - at(side, foot);
  }
  up = direction(up);
  const Vec left = up.cross(across(ahead, up));
  const bool sure = left.norm() >= 0.5 * ahead.norm();
  for (const bool arm : {false, true}) {
    const auto& limb = arm ? kArm : kLeg;
    const Bone first = arm ? Bone::kLeftUpperArm : Bone::kLeftLowerLeg;
    const Vec line = at(Side::kLeft, first) - at(Side::kRight, first);
    if (!sides_are_right(names, bones, limb, line, left, sure, sides_by)) {
      bones.swap_sides(limb.front(), static_cast<int>(limb.size()));
    }
  }
}

// Four limbs that hang side by side from a trunk across them, and end at one height.
bool is_on_four(const std::array<Vec, 4>& begin, const std::array<Vec, 4>& end) {
  Vec down = Vec::Zero();
  for (std::size_t i = 0; i < 4; ++i) down += direction(end[i] - begin[i]);
  down = direction(down);
  const Vec trunk = begin[2] + begin[3] - begin[0] - begin[1];
  const Vec line = begin[0] - begin[1];
  const double leg = (end[0] - begin[0]).norm();
  const double higher = (end[2] + end[3] - end[0] - end[1]).dot(down) / 2;
  const auto across = [](const Vec& a, const Vec& b) {
    return std::abs(direction(a).dot(direction(b))) < 0.5;
  };
  for (std::size_t i = 0; i < 4; ++i) {
    if (angle_deg(end[i] - begin[i], down) > 45) return false;
  }
  return trunk.norm() > 0.5 * leg && across(trunk, down) && across(line, down) &&
         across(line, trunk) && std::abs(higher) < 0.3 * leg;
}

}  // namespace

bool has_named_sides(const std::vector<JointName>& names, const BoneJoints& bones) {
  return votes_by_name(names, bones, kLeg) != 0 || votes_by_name(names, bones, kArm) != 0;
}

bool is_animal(const Figure& figure, const Motion& motion, const BoneJoints& bones) {
  std::array<int, 4> begin{};
  std::array<int, 4> end{};
  for (const Side side : kSides) {
    const auto at = static_cast<std::size_t>(side);
    begin[at] = bones[on(side, Bone::kLeftUpperLeg)];
    begin[at + 2] = bones[on(side, Bone::kLeftUpperArm)];
  }
  for (std::size_t i = 0; i < 4; ++i) end[i] = figure.main_chain(begin[i]).back();
  const auto on_four = [&](auto place) {
    std::array<Vec, 4> from;
    std::array<Vec, 4> to;
    std::ranges::transform(begin, from.begin(), place);
    std::ranges::transform(end, to.begin(), place);
    return is_on_four(from, to);
  };
  if (!on_four([&](int j) { return figure.between(0, j).value_or(Vec::Zero()); })) return false;
  const double often = motion.mean(
      [&](int i) { return on_four([&](int j) { return motion.position(i, j); }) ? 1.0 : 0.0; });
  return often > 0.5;
}

std::optional<BoneJoints> limbs_by_shape(const Figure& figure, const std::vector<JointName>& names,
                                         SidesBy& sides_by, int without) {
  std::vector<Pair> pairs = find_pairs(figure);
  std::erase_if(pairs,
                [&](const Pair& p) { return without >= 0 && figure.below(without, p.parent); });
  double best = 0.0;
  const Pair* legs = nullptr;
  const Pair* arms = nullptr;
  TwoBones as_arm;
  const auto pairs_at = [&pairs](int joint) {
    return std::ranges::count(pairs, joint, &Pair::parent);
  };
  for (const Pair& leg : pairs) {
    for (const Pair& arm : pairs) {
      // Many equal limbs at one joint are a spider's.
      if (&leg == &arm || (leg.parent == arm.parent && pairs_at(leg.parent) > 4)) continue;
      const auto cut = fit_together(figure, leg, arm);
      if (!cut) continue;
      const double score = person_score(figure, leg, arm, *cut);
      if (score <= best * (1 + 1e-9)) continue;
      as_arm = *cut;
      best = score;
      legs = &leg;
      arms = &arm;
    }
  }
  if (legs == nullptr) return std::nullopt;
  BoneJoints bones;
  set_limb(*legs, false, legs->as_leg, bones);
  set_limb(*arms, true, as_arm, bones);
  if (!bones.has_limbs()) return std::nullopt;
  settle_sides(figure, names, bones, sides_by);
  return bones;
}

bool begins_in_palm(const Figure& figure, const std::vector<int>& finger) {
  return finger.size() > 1 && figure[finger[0]].offset.norm() < figure[finger[1]].offset.norm();
}

std::optional<HandShape> hand_by_shape(const Figure& figure) {
  HandShape hand;
  while (figure.children(hand.palm).size() == 1) hand.palm = figure.children(hand.palm).front();
  auto chains = spread_at(figure, hand.palm);
  if (chains.size() != hand.fingers.size()) return std::nullopt;
  Vec along = Vec::Zero();
  for (const auto& chain : chains) along += direction(way_to_tip(figure, hand.palm, chain));
  const auto reach = [&](const std::vector<int>& chain) {
    return way_to_tip(figure, hand.palm, chain).dot(direction(along));
  };
  std::ranges::stable_sort(chains, {}, reach);
  constexpr double kThumb = 0.95;  // a thumb ends before a little finger does
  if (reach(chains[0]) > kThumb * reach(chains[1])) return std::nullopt;
  const int thumb = chains[0][chains[0].size() / 2];
  if (!order_across(figure, hand.palm, thumb, std::span(chains).subspan(1))) return std::nullopt;
  for (std::size_t f = 0; f < chains.size(); ++f) {
    auto& chain = chains[f];
    const bool in_palm = f > 0 && chain.size() > kFingerJoints && begins_in_palm(figure, chain);
    if (in_palm) chain.erase(chain.begin());
    if (chain.size() > kFingerJoints) chain.resize(kFingerJoints);
    hand.fingers[f] = std::move(chain);
  }
  return hand;
}

}  // namespace posed::rig
