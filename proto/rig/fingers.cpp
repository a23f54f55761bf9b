#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "proto/rig/bones.hpp"

namespace posed::rig {
namespace {

using FingerJoints = std::map<int, std::vector<int>>;  // [finger], from the hand on

// A tip may be the name of a finger's last joint; other helpers are no part of it.
bool is_helper(const JointName& name) { return name.helper && !name.has("tip"); }

// Whether the number after "finger" counts the joints along one finger, not the fingers.
bool counts_joints(const Figure& figure, const std::vector<JointName>& names,
                   const std::vector<int>& below) {
  return std::ranges::any_of(below, [&](int j) {
    const int parent = figure[j].parent;
    return is_any_finger(names[j]) && names[parent].words == names[j].words &&
           !names[j].digits.empty() && !names[parent].digits.empty() &&
           names[j].digits.front() != names[parent].digits.front();
  });
}

// Of joints of one finger those from its root on; a joint beside it helps the skin. All where none
// lies below another.
std::vector<int> one_finger(const Figure& figure, const std::vector<int>& joints) {
  std::vector<int> longest;
  for (const int root : joints) {
    std::vector<int> finger;
    std::ranges::copy_if(joints, std::back_inserter(finger),
                         [&](int j) { return figure.below(root, j); });
    if (finger.size() > longest.size()) longest = std::move(finger);
  }
  return longest.size() > 1 ? longest : joints;
}

FingerJoints named_fingers(const Figure& figure, const std::vector<JointName>& names, int hand) {
  std::vector<int> below;
  for (int j = 0; j < figure.size(); ++j) {
    if (j != hand && figure.below(hand, j) && !is_helper(names[j])) below.push_back(j);
  }
  const auto any_number = [&](char digit) {
    return std::ranges::any_of(below, [&](int j) {
      return names[j].digits.starts_with(digit) && is_any_finger(names[j]);
    });
  };
  const bool from_zero = any_number('0');
  // Where the thumb has a name of its own, the first of four fingers is the index.
  const bool thumb_apart = !any_number('5') && std::ranges::any_of(below, [&names](int j) {
    return finger_of(names[j]) == 0;
  });
  const bool says_which = !counts_joints(figure, names, below);
  FingerJoints out;
  std::map<int, int> finger_at;  // [joint]
  for (const int j : below) {
    const JointName& name = names[j];
    auto finger = finger_of(name);
    if (const auto above = finger_at.find(figure[j].parent); !finger && above != finger_at.end()) {
      finger = above->second;  // whatever its number, it goes on in the same finger
    }
    if (!finger && says_which && is_any_finger(name) && !name.digits.empty()) {
      finger = name.digits.front() - '0' - (from_zero || thumb_apart ? 0 : 1);
    }
    if (!finger || *finger < 0 || *finger >= kFingers) continue;
    finger_at.emplace(j, *finger);
    if (finger_of(name) || is_any_finger(name)) out[*finger].push_back(j);
  }
  for (auto& [finger, joints] : out) joints = one_finger(figure, joints);
  return out;
}

Vec place_in(const Figure& figure, int hand, int joint) {
  return figure.between(hand, joint).value_or(Vec::Zero());
}

double length(const Figure& figure, int from, int to) { return place_in(figure, from, to).norm(); }

// Whether the first of a thumb's joints is a bone of the wrist: it is counted from zero, or very
// short, and the last one is no tip.
bool begins_in_wrist(const Figure& figure, const std::vector<JointName>& names,
                     const std::vector<int>& joints) {
  constexpr double kShort = 0.35;  // of the next bone
  const std::string& digits = names[joints[0]].digits;
  const bool from_zero = finger_of(names[joints[0]]) && (digits == "0" || digits == "00");
  const bool is_short =
      length(figure, joints[0], joints[1]) < kShort * length(figure, joints[1], joints[2]);
  const bool ends = figure.children(joints[3]).empty() && figure.end_length(joints[3]) <= 0.0;
  return (from_zero || is_short) && !ends;
}

// Leaves the three joints of a finger: without tips, and without the bone inside the palm, which
// begins nearer to the wrist than it is long.
void trim_finger(const Figure& figure, const std::vector<JointName>& names, int hand, int finger,
                 std::vector<int>& joints) {
  if (finger > 0 && joints.size() > 3) {
    // Apple's "IntermediateTip" is where a phalanx ends, and another tip ends the finger.
    int tip = -1;
    for (const int j : joints) tip = names[j].has("tip") ? j : tip;
    std::erase_if(joints, [&](int j) {
      return j == tip || std::ranges::any_of(std::array{"meta", "metacarpal", "in", "inhand"},
                                             [&](const char* word) { return names[j].has(word); });
    });
  }
  if (joints.size() == 1) {
    // CMU's one thumb joint lies in the wrist, and no thumb does. A fourth joint alone is a tip.
    const JointName& only = names[joints.front()];
    const bool is_tip = only.digits == "4" && !is_any_finger(only);
    if (is_tip || figure[joints.front()].offset.isZero()) joints.clear();
  }
  if (joints.size() <= 3) return;
  const JointName& first = names[joints.front()];
  const bool in_palm =
      finger == 0 ? begins_in_wrist(figure, names, joints)
                  : first.has("root") || first.has("metacarpal") || first.digits.empty() ||
                        first.digits == "0" || first.digits == "00" ||
                        length(figure, hand, joints[0]) < length(figure, joints[0], joints[1]);
  if (in_palm) joints.erase(joints.begin());
  joints.resize(3);
}

using Chains = std::vector<std::vector<int>>;

// The chains below a hand that may be fingers: of two joints and more, from the hand or from a palm
// below it.
Chains chains_of(const Figure& figure, const std::vector<JointName>& names, int hand) {
  const auto starts = [&](int joint) {
    std::vector<int> out;
    std::ranges::copy_if(figure.children(joint), std::back_inserter(out), [&](int child) {
      return !names[child].helper && figure.main_chain_length(child) > 1;
    });
    return out;
  };
  int palm = hand;
  for (auto next = starts(palm); next.size() == 1; next = starts(palm)) palm = next.front();
  Chains out;
  for (const int start : starts(palm)) {
    const auto below = starts(start);
    for (const int first : below.size() > 1 ? below : std::vector{start}) {
      auto chain = figure.main_chain(first);
      std::erase_if(chain, [&](int j) { return names[j].helper; });
      if (chain.size() > 1) out.push_back(std::move(chain));
    }
  }
  return out;
}

// Which of five chains is the thumb's: it begins nearest to the wrist, or has one joint less than
// each other one. -1 when that is not sure.
int thumb_of(const Figure& figure, int hand, const Chains& chains) {
  constexpr double kNear = 0.7;  // of the way to the next one
  const auto way = [&](const std::vector<int>& chain) {
    return length(figure, hand, chain.front());
  };
  const auto joints = [](const std::vector<int>& chain) { return chain.size(); };
  const auto alone = [&](const auto& measure, double factor) {
    const auto least = std::ranges::min_element(chains, {}, measure);
    const auto is_other = [&](const auto& chain) {
      return &chain == &*least ||
             static_cast<double>(measure(*least)) <= factor * static_cast<double>(measure(chain));
    };
    return std::ranges::all_of(chains, is_other) ? static_cast<int>(least - chains.begin()) : -1;
  };
  const int nearest = alone(way, kNear);
  const int shortest = alone(joints, 0.99);
  return nearest < 0 || nearest == shortest || shortest < 0 ? std::max(nearest, shortest) : -1;
}

// The fingers of five chains: the thumb is known, and the others lie in a row across the palm, in
// whose order the index is on the thumb's side. Empty when they lie otherwise.
std::optional<Chains> fingers_by_place(const Figure& figure, int hand, Chains chains) {
  const auto reach = [&](const std::vector<int>& chain) {
    return length(figure, chain.front(), chain.back());
  };
  if (chains.size() > static_cast<std::size_t>(kFingers)) {  // what the hand holds is longer
    constexpr double kLong = 2.5;
    std::ranges::sort(chains, {}, reach);
    const double usual = reach(chains[chains.size() / 2]);
    std::erase_if(chains, [&](const auto& chain) { return reach(chain) > kLong * usual; });
  }
  if (chains.size() != static_cast<std::size_t>(kFingers)) return std::nullopt;
  const int thumb = thumb_of(figure, hand, chains);
  if (thumb < 0) return std::nullopt;
  std::swap(chains[0], chains[thumb]);
  const std::size_t joints = chains[1].size();
  const bool alike = std::all_of(chains.begin() + 1, chains.end(),
                                 [&](const auto& chain) { return chain.size() == joints; });
  const auto row = order_across(figure, hand, chains[0].front(), std::span(chains).subspan(1));
  if (!alike || !row || !(row->norm() > 0.0)) return std::nullopt;
  constexpr double kGap = 0.1;  // of the row's length
  for (std::size_t i = 2; i < chains.size(); ++i) {
    const Vec step =
        place_in(figure, hand, chains[i].front()) - place_in(figure, hand, chains[i - 1].front());
    if (step.dot(*row) < kGap * row->squaredNorm()) return std::nullopt;
  }
  return chains;
}

// Whether each named finger is the chain at its place.
bool agree(const Chains& placed, const FingerJoints& named) {
  return std::ranges::all_of(named, [&](const auto& finger) {
    const auto& chain = placed[static_cast<std::size_t>(finger.first)];
    return std::ranges::find(chain, finger.second.front()) != chain.end();
  });
}

// Adds the fingers that have no known name.
FingersBy add_unnamed(const Figure& figure, const std::vector<JointName>& names, int hand,
                      FingerJoints& fingers) {
  constexpr std::size_t kFew = 4;  // a hand has as many fingers without its thumb
  const Chains chains = chains_of(figure, names, hand);
  const auto is_named = [&](const std::vector<int>& chain) {
    return std::ranges::any_of(fingers, [&](const auto& finger) {
      return figure.below(chain.front(), finger.second.front());
    });
  };
  const auto named = static_cast<std::size_t>(std::ranges::count_if(chains, is_named));
  if (chains.size() < kFew || named == chains.size() || std::ssize(fingers) == kFingers) {
    return FingersBy::kNames;
  }
  const auto placed = fingers_by_place(figure, hand, chains);
  if (placed && agree(*placed, fingers)) {
    for (std::size_t f = 0; f < placed->size(); ++f) {
      fingers.try_emplace(static_cast<int>(f), (*placed)[f]);
    }
    return FingersBy::kPlace;
  }
  return named + 1 < chains.size() ? FingersBy::kNothing : FingersBy::kNames;
}

}  // namespace

std::optional<Vec> order_across(const Figure& figure, int palm, int thumb,
                                std::span<std::vector<int>> fingers) {
  constexpr double kAside = 0.2;  // of the row's length
  const auto base = [&](const std::vector<int>& chain) {
    return place_in(figure, palm, chain.front());
  };
  Vec row = Vec::Zero();  // from one end to the other
  Vec middle = Vec::Zero();
  for (std::size_t a = 0; a < fingers.size(); ++a) {
    middle += base(fingers[a]) / static_cast<double>(fingers.size());
    for (std::size_t b = 0; b < a; ++b) {
      const Vec way = base(fingers[a]) - base(fingers[b]);
      if (way.norm() > row.norm()) row = way;
    }
  }
  const double aside = (place_in(figure, palm, thumb) - middle).dot(row);
  if (std::abs(aside) < kAside * row.squaredNorm()) return std::nullopt;
  if (aside > 0.0) row = -row;
  std::ranges::stable_sort(fingers, {}, [&](const auto& chain) { return base(chain).dot(row); });
  return row;
}

FingersBy find_fingers(const Figure& figure, const std::vector<JointName>& names, Side side,
                       BoneJoints& bones) {
  const int hand = bones[on(side, Bone::kLeftHand)];
  FingerJoints fingers = named_fingers(figure, names, hand);
  const FingersBy by = add_unnamed(figure, names, hand, fingers);
  for (auto& [finger, joints] : fingers) {
    trim_finger(figure, names, hand, finger, joints);
    const int first = static_cast<int>(Bone::kLeftThumbMetacarpal) + kFingerJoints * finger;
    for (int i = 0; i < kFingerJoints && i < std::ssize(joints); ++i) {
      bones.set(on(side, static_cast<Bone>(first + i)), joints[i]);
    }
  }
  return by;
}

}  // namespace posed::rig
