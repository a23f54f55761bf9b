// Names of joints, taken apart into a side, anatomical words and numbers, and the dictionary that
// says which bones a word may mean. One word means several bones (Shoulder, Hip, Arm, Leg, Foot);
// only the order in a chain decides, so a word has a fit to each slot of its limb. Cold.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace posed::rig {

enum class NameSide : signed char { kRight = -1, kNone = 0, kLeft = 1 };

struct JointName {
  NameSide side = NameSide::kNone;
  std::string stem;                // the words, joined
  std::vector<std::string> words;  // without side, numbers and what says nothing
  std::string digits;              // numbers, joined by '_'
  bool helper = false;             // a twist, tip, eye, prop and the like: never a bone

  [[nodiscard]] bool has(std::string_view word) const;
};

// Takes the names of one skeleton apart. A first or last word that nearly all of them have (Bip01,
// CC_Base, _JNT) is dropped, so makers need not be known.
[[nodiscard]] std::vector<JointName> parse_names(const std::vector<std::string_view>& names);

// How well a name fits Shoulder, UpperArm, LowerArm, Hand, or UpperLeg, LowerLeg, Foot, Toes: 0 to
// 1 each. Empty for names that have nothing to do with that limb.
using Fit = std::array<double, 4>;
[[nodiscard]] std::optional<Fit> arm_fit(const JointName& name);
[[nodiscard]] std::optional<Fit> leg_fit(const JointName& name);

[[nodiscard]] bool is_trunk(const JointName& name);  // also "spine.004"
[[nodiscard]] bool is_pelvis(const JointName& name);
[[nodiscard]] bool is_neck(const JointName& name);
[[nodiscard]] bool is_head(const JointName& name);

// 0 thumb to 4 little finger; empty when no word says it. A numbered "finger" is not looked at.
[[nodiscard]] std::optional<int> finger_of(const JointName& name);
// "finger", "digit": its number says which one.
[[nodiscard]] bool is_any_finger(const JointName& name);

}  // namespace posed::rig
