#include "drivers/mvn/segments.hpp"

#include <string_view>

namespace posed::drivers::mvn {
namespace {

struct BodySegment {
  std::string_view name;
  std::optional<Bone> bone;
};

// Of the four segments between pelvis and neck, the first two and the last are bones, as in files
// of such figures.
constexpr std::array<BodySegment, kBodySegments> kBody{{
    {"Pelvis", Bone::kHips},
    {"L5", Bone::kSpine},
    {"L3", Bone::kChest},
    {"T12", std::nullopt},
    {"T8", Bone::kUpperChest},
    {"Neck", Bone::kNeck},
    {"Head", Bone::kHead},
    {"RightShoulder", Bone::kRightShoulder},
    {"RightUpperArm", Bone::kRightUpperArm},
    {"RightForeArm", Bone::kRightLowerArm},
    {"RightHand", Bone::kRightHand},
    {"LeftShoulder", Bone::kLeftShoulder},
    {"LeftUpperArm", Bone::kLeftUpperArm},
    {"LeftForeArm", Bone::kLeftLowerArm},
    {"LeftHand", Bone::kLeftHand},
    {"RightUpperLeg", Bone::kRightUpperLeg},
    {"RightLowerLeg", Bone::kRightLowerLeg},
    {"RightFoot", Bone::kRightFoot},
    {"RightToe", Bone::kRightToes},
    {"LeftUpperLeg", Bone::kLeftUpperLeg},
    {"LeftLowerLeg", Bone::kLeftLowerLeg},
    {"LeftFoot", Bone::kLeftFoot},
    {"LeftToe", Bone::kLeftToes},
}};

struct HandSegment {
  std::string_view name;
  int bone = -1;  // counted from the thumb's metacarpal
};
constexpr std::array<HandSegment, kHandSegments> kHand{{
    {"Carpus"},
    {"FirstMetacarpal", 0},
    {"FirstProximalPhalange", 1},
    {"FirstDistalPhalange", 2},
    {"SecondMetacarpal"},
    {"SecondProximalPhalange", 3},
    {"SecondMiddlePhalange", 4},
    {"SecondDistalPhalange", 5},
    {"ThirdMetacarpal"},
    {"ThirdProximalPhalange", 6},
    {"ThirdMiddlePhalange", 7},
    {"ThirdDistalPhalange", 8},
    {"FourthMetacarpal"},
    {"FourthProximalPhalange", 9},
    {"FourthMiddlePhalange", 10},
    {"FourthDistalPhalange", 11},
    {"FifthMetacarpal"},
    {"FifthProximalPhalange", 12},
    {"FifthMiddlePhalange", 13},
    {"FifthDistalPhalange", 14},
}};

constexpr JointTable make_table(bool fingers) noexcept {
  JointTable table;
  std::array<int, kSegments> joint_of{};
  const auto add = [&](std::size_t segment) {
    const int parent = parent_segment(segment);
    table.parent[table.count] = parent < 0 ? -1 : joint_of[parent];
    joint_of[segment] = static_cast<int>(table.count);
    table.segment[table.count++] = static_cast<std::uint8_t>(segment);
  };
  for (std::size_t segment = 0; segment < kBodySegments; ++segment) {
    add(segment);
    if (!fingers || (segment != kRightHandSegment && segment != kLeftHandSegment)) continue;
    const std::size_t carpus = segment == kLeftHandSegment ? kLeftFingers : kRightFingers;
    for (std::size_t i = 0; i < kHandSegments; ++i) add(carpus + i);
  }
  return table;
}

constexpr JointTable kBodyTable = make_table(false);
constexpr JointTable kWholeTable = make_table(true);

}  // namespace

const JointTable& joint_table(bool fingers) noexcept { return fingers ? kWholeTable : kBodyTable; }

std::string segment_name(std::size_t segment) {
  if (segment < kBodySegments) return std::string(kBody.at(segment).name);
  const bool left = segment < kRightFingers;
  const std::size_t carpus = left ? kLeftFingers : kRightFingers;
  return (left ? "Left" : "Right") + std::string(kHand.at(segment - carpus).name);
}

std::optional<Bone> segment_bone(std::size_t segment) {
  if (segment < kBodySegments) return kBody.at(segment).bone;
  const bool left = segment < kRightFingers;
  const int bone = kHand.at(segment - (left ? kLeftFingers : kRightFingers)).bone;
  if (bone < 0) return std::nullopt;
  const Bone first = left ? Bone::kLeftThumbMetacarpal : Bone::kRightThumbMetacarpal;
  return static_cast<Bone>(static_cast<int>(first) + bone);
}

}  // namespace posed::drivers::mvn
