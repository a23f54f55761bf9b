#include "drivers/natnet/bones.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace posed::drivers::natnet {
namespace {

constexpr std::array<std::pair<std::string_view, Bone>, 5> kMotiveMiddle{{{"Hip", Bone::kHips},
                                                                          {"Ab", Bone::kSpine},
                                                                          {"Chest", Bone::kChest},
                                                                          {"Neck", Bone::kNeck},
                                                                          {"Head", Bone::kHead}}};

// Without their side, and the left one.
constexpr std::array<std::pair<std::string_view, Bone>, 8> kMotiveLimbs{
    {{"Shoulder", Bone::kLeftShoulder},
     {"UArm", Bone::kLeftUpperArm},
     {"FArm", Bone::kLeftLowerArm},
     {"Hand", Bone::kLeftHand},
     {"Thigh", Bone::kLeftUpperLeg},
     {"Shin", Bone::kLeftLowerLeg},
     {"Foot", Bone::kLeftFoot},
     {"Toe", Bone::kLeftToes}}};

// The first of three joints, numbered from 1.
constexpr std::array<std::pair<std::string_view, Bone>, 5> kMotiveFingers{
    {{"Thumb", Bone::kLeftThumbMetacarpal},
     {"Index", Bone::kLeftIndexProximal},
     {"Middle", Bone::kLeftMiddleProximal},
     {"Ring", Bone::kLeftRingProximal},
     {"Pinky", Bone::kLeftLittleProximal}}};

template <std::size_t N>
std::optional<Bone> find_in(const std::array<std::pair<std::string_view, Bone>, N>& table,
                            std::string_view name) {
  const auto at = std::ranges::find(table, name, &std::pair<std::string_view, Bone>::first);
  return at == table.end() ? std::nullopt : std::optional(at->second);
}

std::optional<Bone> left_bone(std::string_view part) {
  if (const auto limb = find_in(kMotiveLimbs, part)) return limb;
  if (part.empty() || part.back() < '1' || part.back() > '3') return std::nullopt;
  const auto finger = find_in(kMotiveFingers, part.substr(0, part.size() - 1));
  if (!finger) return std::nullopt;
  return static_cast<Bone>(static_cast<int>(*finger) + part.back() - '1');
}

}  // namespace

std::optional<Bone> motive_bone(std::string_view name) {
  if (const auto middle = find_in(kMotiveMiddle, name)) return middle;
  if (name.empty() || (name[0] != 'L' && name[0] != 'R')) return std::nullopt;
  const auto left = left_bone(name.substr(1));
  if (!left || name[0] == 'L') return left;
  return bone_from_name("right" + std::string(bone_name(*left).substr(4)));
}

}  // namespace posed::drivers::natnet
