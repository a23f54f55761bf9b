// Which joint is which bone, from the names and the shape of the tree alone. Cold.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/frame/hand.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/rig/figure.hpp"
#include "proto/rig/motion.hpp"
#include "proto/rig/words.hpp"

namespace posed::rig {

inline constexpr std::array kSides{Side::kLeft, Side::kRight};

// The left bone's counterpart of a side.
[[nodiscard]] Bone on(Side side, Bone left);

// The joint of each bone; -1 where there is none.
class BoneJoints {
 public:
  BoneJoints() { joint_.fill(-1); }
  [[nodiscard]] int operator[](Bone bone) const { return joint_[static_cast<std::size_t>(bone)]; }
  [[nodiscard]] bool has(Bone bone) const { return (*this)[bone] >= 0; }
  void set(Bone bone, int joint) { joint_[static_cast<std::size_t>(bone)] = joint; }
  // Of `count` bones from a left one on, with their right counterparts.
  void swap_sides(Bone first_left, int count);
  [[nodiscard]] bool has_limbs() const;  // both sides' upper and lower arms and legs
  [[nodiscard]] std::vector<std::optional<Bone>> by_joint(int joints) const;

 private:
  std::array<int, kBones> joint_{};
};

enum class Kind : std::uint8_t {
  kPerson,  // two legs, two arms and what joins them
  kPart,    // some bones of a person, known by name
  kHand,    // a hand without a body
};

// What says which side of a person is left, or which hand it is.
enum class SidesBy : std::uint8_t { kNames, kFeet, kBends, kNothing };

struct FoundBones {
  Kind kind = Kind::kPart;
  BoneJoints joint;
  SidesBy sides_by = SidesBy::kNames;
  std::array<bool, 2> by_place{};  // [side, left first]: some fingers are known by place only
  std::vector<std::string> notes;  // sentences
};

[[nodiscard]] FoundBones find_bones(const Figure& figure, const std::vector<JointName>& names);

// Whether a figure with these limbs stands on all fours, in its zero pose and in the clip.
[[nodiscard]] bool is_animal(const Figure& figure, const Motion& motion, const BoneJoints& bones);

// Of a hand whose joints are those of a right one's bones: +1 when its fingers bend as a left
// hand's, or the thumb lies below such a palm, -1 for a right one's, 0 when they do not tell.
[[nodiscard]] int sided_by_fingers(const Figure& figure, const Motion& motion,
                                   const BoneJoints& bones);

void swap_all_sides(BoneJoints& bones);

// Whether the names say of the legs or of the arms which one is left.
[[nodiscard]] bool has_named_sides(const std::vector<JointName>& names, const BoneJoints& bones);

// Swaps the sides of a person whose zero pose, by them, does not face `facing`. Returns whether it
// did.
bool turn_to_face(const Vec& facing, const Figure& figure, BoneJoints& bones);

// Legs and arms by names: along each path from the root the words that fit best, in the order of
// the limb.
void find_limbs(const Figure& figure, const std::vector<JointName>& names, BoneJoints& bones);

// Legs and arms by the tree alone: two mirrored pairs of chains, one above the other. The names,
// else the feet, say which side is left. What is below the joint `without` does not count. Empty
// when the tree has no such pairs.
[[nodiscard]] std::optional<BoneJoints> limbs_by_shape(const Figure& figure,
                                                       const std::vector<JointName>& names,
                                                       SidesBy& sides_by, int without = -1);

// Whether a finger's chain begins with a joint in the palm: the bone to it is shorter than the
// next.
[[nodiscard]] bool begins_in_palm(const Figure& figure, const std::vector<int>& finger);

// A hand without a body, and the joints of its fingers, thumb first.
struct HandShape {
  int palm = 0;
  std::array<std::vector<int>, kFingers> fingers;
};

// The hand that is the whole figure: one joint that spreads five short chains, of which the
// shortest reach is the thumb's. Empty for anything else.
[[nodiscard]] std::optional<HandShape> hand_by_shape(const Figure& figure);

// Puts the four fingers' chains in their order across the palm, whose row begins on the side of
// `thumb`, a joint of the thumb. Returns the row, from the index' side on; empty, and the order may
// be any, where the thumb is not aside.
std::optional<Vec> order_across(const Figure& figure, int palm, int thumb,
                                std::span<std::vector<int>> fingers);

// Pelvis, trunk, neck and head from where the limbs begin.
void find_trunk(const Figure& figure, const std::vector<JointName>& names, BoneJoints& bones,
                std::vector<std::string>& notes);

// What says which joints are the fingers of a hand; kNothing where joints look like fingers and
// neither does.
enum class FingersBy : std::uint8_t { kNames, kPlace, kNothing };

// Fingers below the joint of the side's hand: by their names, and those without a known name by
// their places, of which the thumb's is nearest to the wrist.
FingersBy find_fingers(const Figure& figure, const std::vector<JointName>& names, Side side,
                       BoneJoints& bones);

}  // namespace posed::rig
