#include <cmath>
#include <numeric>

#include "proto/rig/bones.hpp"

namespace posed::rig {
namespace {

constexpr std::size_t kMaxPairs = 400;  // the longest; a person has a dozen
constexpr int kMaxSiblings = 64;
constexpr int kLimbJoints = 4;

constexpr std::array kLeg{Bone::kLeftUpperLeg, Bone::kLeftLowerLeg, Bone::kLeftFoot,
                          Bone::kLeftToes};
constexpr std::array kArm{Bone::kLeftShoulder, Bone::kLeftUpperArm, Bone::kLeftLowerArm,
                          Bone::kLeftHand};

// The first segments, as far as both sides' are alike: behind them a hand may hold a prop.
std::vector<double> shared_segments(const std::vector<double>& one,
                                    const std::vector<double>& other) {
  constexpr double kAlike = 0.75;
  constexpr std::size_t kMinAlike = 3;
  std::vector<double> out;
  for (std::size_t i = 0; i < std::min(one.size(), other.size()); ++i) {
    const auto [less, more] = std::minmax(one[i], other[i]);
    if (i >= kMinAlike && less < kAlike * more) break;
    out.push_back(less);
  }
  return out;
}

// Where the longest two consecutive segments of a limb begin: thigh and shin, upper and lower arm.
// Clavicles come before an arm, so of nearly equal ones the last counts there.
std::size_t long_bones(const std::vector<double>& segments, bool arm) {
  std::size_t first = 0;
  double longest = 0.0;
  for (std::size_t i = 0; i + 1 < segments.size(); ++i) {
    longest = std::max(longest, std::min(segments[i], segments[i + 1]));
  }
  for (std::size_t i = 0; i + 1 < segments.size(); ++i) {
    if (std::min(segments[i], segments[i + 1]) > (arm ? 0.8 : 0.999) * longest) first = i;
  }
  return first;
}

double two_bones(const std::vector<double>& segments, bool arm) {
  if (segments.size() < 2) return 0.0;
  const std::size_t first = long_bones(segments, arm);
  return segments[first] + segments[first + 1];
}

constexpr double kArmOfLeg = 0.63;    // upper and lower arm, of thigh and shin
constexpr double kTrunkOfLeg = 0.45;  // from where the legs begin to where the arms do

double unlike(double one, double other) {
  return std::abs(std::log(std::max(one, 1e-9) / std::max(other, 1e-9)));
}

// Where a limb's upper bone begins, where it bends and where its lower bone ends: numbers of the
// joints in its chain.
struct TwoBones {
  std::size_t begin = 0, bend = 1, end = 2;
  double length = 0.0;
};

// A limb of a pair whose bones are cut by joints that only twist.
class CutLimb {
 public:
  CutLimb(const Figure& figure, int one, int other)
      : chain_(figure.main_chain(one)), to_first_(figure[one].offset.norm()) {
    const auto a = figure.segments(chain_);
    const auto b = figure.segments(figure.main_chain(other));
    chain_.resize(std::min({a.size(), b.size(), kMaxJoints}));
    at_.push_back(0.0);
    for (std::size_t i = 0; i < chain_.size(); ++i) at_.push_back(at_[i] + std::min(a[i], b[i]));
    for (std::size_t i = 1; i + 1 < chain_.size(); ++i) {
      const double bent = angle_deg(figure[chain_[i]].offset, figure[chain_[i + 1]].offset);
      bends_.push_back(at_[i + 1] > at_[i] && bent > kBent_deg);
    }
  }

  // The cut that is likest a person's: two bones about as long as each other, straight, with what
  // is left for a hand or a foot behind them. `leg`: the leg's length for an arm; 0 for a leg.
  [[nodiscard]] std::optional<TwoBones> best(double leg) const {
    std::optional<TwoBones> found;
    double least = kMaxCost;
    for (std::size_t begin = 0; begin + 2 < chain_.size(); ++begin) {
      for (std::size_t bend = begin + 1; bend + 1 < chain_.size(); ++bend) {
        for (std::size_t end = bend + 1; end < chain_.size(); ++end) {
          const TwoBones two{begin, bend, end, way(begin, end)};
          const double cost = cost_of(two, leg);
          if (cost >= least) continue;
          least = cost;
          found = two;
        }
      }
    }
    return found;
  }

 private:
  static constexpr std::size_t kMaxJoints = 12;
  static constexpr double kBent_deg = 8.0;
  static constexpr double kMaxCost = 1.5;

  [[nodiscard]] double way(std::size_t from, std::size_t to) const { return at_[to] - at_[from]; }

  // How far a length is from what is usual, as a logarithm beyond what people differ by.
  static double off(double length, double usual, double differ) {
    return std::max(0.0, unlike(length, usual) - differ);
  }

  [[nodiscard]] double cost_of(const TwoBones& two, double leg) const {
    double cost = unlike(way(two.begin, two.bend), way(two.bend, two.end));
    for (std::size_t i = two.begin + 1; i < two.end; ++i) {
      if (i != two.bend && bends_[i - 1]) cost += 0.5;
    }
    const double rest = at_.back() - at_[two.end];
    if (leg <= 0.0) {
      cost += rest > 0.0 ? 0.5 * off(rest, 0.25 * two.length, 0.4) : 0.5;
      return cost + at_[two.begin] / two.length;
    }
    cost += unlike(two.length, kArmOfLeg * leg);
    cost += rest > 0.0 ? 0.3 * off(rest, 0.2 * leg, 0.7) : 0.1;
    return cost + 0.7 * off(to_first_ + at_[two.begin], 0.3 * leg, 0.3);  // across the shoulders
  }

  std::vector<int> chain_;
  double to_first_ = 0.0;    // from the trunk
  std::vector<double> at_;   // [joint of the chain, then its end] along the limb
  std::vector<bool> bends_;  // [joint of the chain but the first and the last]
};

// Whether two consecutive segments are too unlike for a limb's two bones: their maker cut one.
bool are_unequal(const std::vector<double>& segments, std::size_t first) {
  constexpr double kMostUnequal = 0.5;  // as a logarithm
  return first + 1 < segments.size() && unlike(segments[first], segments[first + 1]) > kMostUnequal;
}

// The same, or too short.
bool are_cut(const std::vector<double>& segments, std::size_t first) {
  constexpr double kLeastPart = 0.6;
  if (first + 1 >= segments.size()) return false;
  const double all = std::accumulate(segments.begin(), segments.end(), 0.0);
  return segments[first] + segments[first + 1] < kLeastPart * all || are_unequal(segments, first);
}

// Where the upper arm is among an arm's segments. Two that are longer than a leg are what the hand
// holds.
std::size_t upper_arm(const std::vector<double>& segments, double leg) {
  std::size_t first = long_bones(segments, true);
  if (segments.size() < 2 || two_bones(segments, true) <= leg) return first;
  double least = 1e300;
  for (std::size_t i = 0; i + 1 < segments.size(); ++i) {
    const double off = unlike(segments[i] + segments[i + 1], kArmOfLeg * leg) +
                       unlike(segments[i], segments[i + 1]);
    if (off >= least) continue;
    least = off;
    first = i;
  }
  return first;
}

// Two chains that begin at one joint and are as long as each other, as far as a limb goes: a hand
// may hold a prop.
struct Pair {
  double length = 0.0;
  double as_leg = 0.0, as_arm = 0.0;  // of its two long bones
  int parent = 0;
  int one = 0, other = 0;       // where the chains begin
  bool unequal_arm = false;     // its two long bones are no upper and lower arm
  std::optional<TwoBones> cut;  // of a leg whose bones are cut
};

std::optional<Pair> mirrored(const Figure& figure, int parent, int one, int other) {
  const int joints = figure.main_chain_length(one);
  const int others = figure.main_chain_length(other);
  const bool whole = std::min(joints, others) >= kLimbJoints;
  if (std::min(joints, others) < 3 || (joints != others && !whole)) return std::nullopt;
  const auto a = figure.segments(figure.main_chain(one));
  const auto b = figure.segments(figure.main_chain(other));
  double length = 0.0;
  double gap = 0.0;
  const std::size_t compared =
      joints == others ? std::min<std::size_t>(a.size(), kLimbJoints) : kLimbJoints - 1;
  for (std::size_t i = 0; i < compared; ++i) {
    length += a[i];
    gap += std::abs(a[i] - b[i]);
  }
  const double apart = std::abs(figure[one].offset.norm() - figure[other].offset.norm());
  if (!(length > 0.0) || gap >= 0.15 * length || apart >= 0.15 * length) return std::nullopt;
  const auto both = shared_segments(a, b);
  Pair pair{.length = length,
            .as_leg = two_bones(both, false),
            .as_arm = two_bones(both, true),
            .parent = parent,
            .one = one,
            .other = other,
            .unequal_arm = are_unequal(both, long_bones(both, true)),
            .cut = {}};
  if (are_cut(both, long_bones(both, false))) {
    pair.cut = CutLimb(figure, one, other).best(0.0);
    if (pair.cut) pair.as_leg = pair.cut->length;
  }
  return pair;
}

// Whether the longest two segments cannot be an arm's bones, of a leg of this length.
bool is_cut_arm(const Pair& arms, double leg) {
  return arms.unequal_arm || arms.as_arm < 0.8 * kArmOfLeg * leg;
}

std::vector<Pair> find_pairs(const Figure& figure) {
  std::vector<Pair> pairs;
  for (int j = 0; j < figure.size(); ++j) {
    const auto& children = figure.children(j);
    const int count = std::min(static_cast<int>(children.size()), kMaxSiblings);
    for (int a = 0; a < count; ++a) {
      for (int b = a + 1; b < count; ++b) {
        if (const auto pair = mirrored(figure, j, children[a], children[b])) pairs.push_back(*pair);
      }
    }
  }
  if (pairs.size() > kMaxPairs) {
    std::ranges::stable_sort(pairs, std::greater{}, &Pair::length);
    pairs.resize(kMaxPairs);
  }
  return pairs;
}

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

// Legs and arms hang on one trunk, none in another. The joint of the legs is above that of the
// arms, or each is on a branch of its own. Fingers of two hands are no limbs.
bool fit_together(const Figure& figure, const Pair& legs, const Pair& arms) {
  const auto in = [&figure](const Pair& pair, int joint) {
    return figure.below(pair.one, joint) || figure.below(pair.other, joint);
  };
  const bool overlap = in(arms, legs.one) || in(arms, legs.other);
  const bool one_trunk =
      figure.below(legs.parent, arms.parent) || !figure.below(arms.parent, legs.parent);
  const bool are_fingers =
      !spread_at(figure, legs.parent).empty() && !spread_at(figure, arms.parent).empty();
  return one_trunk && !in(legs, arms.parent) && !in(arms, legs.parent) && !overlap &&
         arms.length >= 0.4 * legs.length && arms.length <= 1.5 * legs.length && !are_fingers;
}

// Number of joints from where the legs' branch leaves the trunk of the arms to the legs.
int branched_off(const Figure& figure, const Pair& legs, const Pair& arms) {
  return figure.depth(legs.parent) - figure.depth(figure.common({legs.parent, arms.parent}));
}

// How well two pairs of limbs are a person's: the longer legs, the better, but wings, hair, capes
// and skirts are of other sizes than arms, or begin elsewhere.
double person_score(const Figure& figure, const Pair& legs, const Pair& arms) {
  constexpr double kArmsDiffer = 0.15;
  constexpr double kTrunksDiffer = 0.7;
  const int common = figure.common({legs.parent, arms.parent});
  const Vec trunk = figure.between(common, arms.parent).value_or(Vec::Zero()) -
                    figure.between(common, legs.parent).value_or(Vec::Zero());
  const double as_arm = arms.cut && is_cut_arm(arms, legs.as_leg) ? arms.cut->length : arms.as_arm;
  const double arm = std::max(0.0, unlike(as_arm, kArmOfLeg * legs.as_leg) - kArmsDiffer);
  const double body =
      std::clamp(unlike(trunk.norm(), kTrunkOfLeg * legs.as_leg) - kTrunksDiffer, 0.0, 1.0);
  const double off = 0.3 * branched_off(figure, legs, arms) + 1e-3 * figure.depth(legs.parent);
  return legs.as_leg * std::exp(-(arm + body + off));
}

// `leg`: length of the legs' two bones.
void set_limb(const Figure& figure, const Pair& pair, bool arm, double leg, BoneJoints& bones) {
  const auto one = figure.segments(figure.main_chain(pair.one));
  const auto other = figure.segments(figure.main_chain(pair.other));
  const auto both = shared_segments(one, other);
  const std::size_t first = arm ? upper_arm(both, leg) : long_bones(both, false);
  TwoBones two{.begin = first, .bend = first + 1, .end = first + 2};
  if (!arm && pair.cut) two = *pair.cut;
  if (arm && is_cut_arm(pair, leg)) {
    two = CutLimb(figure, pair.one, pair.other).best(leg).value_or(two);
  }
  const std::array<std::size_t, 4> at =  // wraps where an arm has no clavicle
      arm ? std::array{two.begin - 1, two.begin, two.bend, two.end}
          : std::array{two.begin, two.bend, two.end, two.end + 1};
  for (const Side side : kSides) {
    const auto chain = figure.main_chain(side == Side::kLeft ? pair.one : pair.other);
    for (std::size_t k = 0; k < at.size(); ++k) {
      if (at[k] < chain.size()) bones.set(on(side, arm ? kArm[k] : kLeg[k]), chain[at[k]]);
    }
  }
}

// Whether `bones` has a limb's sides right: by its names, else by the line from right to left.
bool sides_are_right(const std::vector<JointName>& names, const BoneJoints& bones,
                     const std::array<Bone, 4>& limb, const Vec& line, const Vec& left, bool sure,
                     SidesBy& sides_by) {
  int votes = 0;
  for (const Side side : kSides) {
    for (const Bone bone : limb) {
      const int joint = bones[on(side, bone)];
      if (joint >= 0) votes += static_cast<int>(names[joint].side) * (side == Side::kLeft ? 1 : -1);
    }
  }
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
  const auto pairs_at = [&pairs](int joint) {
    return std::ranges::count(pairs, joint, &Pair::parent);
  };
  for (const Pair& leg : pairs) {
    for (const Pair& arm : pairs) {
      if (&leg == &arm || !fit_together(figure, leg, arm)) continue;
      // Many equal limbs at one joint are a spider's.
      if (leg.parent == arm.parent && pairs_at(leg.parent) > 4) continue;
      const double score = person_score(figure, leg, arm);
      if (score <= best * (1 + 1e-9)) continue;
      best = score;
      legs = &leg;
      arms = &arm;
    }
  }
  if (legs == nullptr) return std::nullopt;
  BoneJoints bones;
  set_limb(figure, *legs, false, legs->as_leg, bones);
  set_limb(figure, *arms, true, legs->as_leg, bones);
  if (!bones.has_limbs()) return std::nullopt;
  settle_sides(figure, names, bones, sides_by);
  return bones;
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
    const bool in_palm = f > 0 && chain.size() > kFingerJoints &&
                         figure[chain[0]].offset.norm() < figure[chain[1]].offset.norm();
    if (in_palm) chain.erase(chain.begin());
    if (chain.size() > kFingerJoints) chain.resize(kFingerJoints);
    hand.fingers[f] = std::move(chain);
  }
  return hand;
}

}  // namespace posed::rig
