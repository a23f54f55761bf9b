#include "drivers/vmc/bones.hpp"

#include <algorithm>

namespace posed::drivers::vmc {
namespace {

// Unity's thumb begins with the bone that VRM 1 and posed call its metacarpal.
constexpr std::array<BoneEntry, kBoneCount> kVmcBones{
    {{"Hips", -1, Bone::kHips},
     {"Spine", 0, Bone::kSpine},
     {"Chest", 1, Bone::kChest},
     {"UpperChest", 2, Bone::kUpperChest},
     {"Neck", 3, Bone::kNeck},
     {"Head", 4, Bone::kHead},
     {"LeftEye", 5, std::nullopt},
     {"RightEye", 5, std::nullopt},
     {"Jaw", 5, std::nullopt},
     {"LeftShoulder", 3, Bone::kLeftShoulder},
     {"LeftUpperArm", 9, Bone::kLeftUpperArm},
     {"LeftLowerArm", 10, Bone::kLeftLowerArm},
     {"LeftHand", 11, Bone::kLeftHand},
     {"LeftThumbProximal", 12, Bone::kLeftThumbMetacarpal},
     {"LeftThumbIntermediate", 13, Bone::kLeftThumbProximal},
     {"LeftThumbDistal", 14, Bone::kLeftThumbDistal},
     {"LeftIndexProximal", 12, Bone::kLeftIndexProximal},
     {"LeftIndexIntermediate", 16, Bone::kLeftIndexIntermediate},
     {"LeftIndexDistal", 17, Bone::kLeftIndexDistal},
     {"LeftMiddleProximal", 12, Bone::kLeftMiddleProximal},
     {"LeftMiddleIntermediate", 19, Bone::kLeftMiddleIntermediate},
     {"LeftMiddleDistal", 20, Bone::kLeftMiddleDistal},
     {"LeftRingProximal", 12, Bone::kLeftRingProximal},
     {"LeftRingIntermediate", 22, Bone::kLeftRingIntermediate},
     {"LeftRingDistal", 23, Bone::kLeftRingDistal},
     {"LeftLittleProximal", 12, Bone::kLeftLittleProximal},
     {"LeftLittleIntermediate", 25, Bone::kLeftLittleIntermediate},
     {"LeftLittleDistal", 26, Bone::kLeftLittleDistal},
     {"RightShoulder", 3, Bone::kRightShoulder},
     {"RightUpperArm", 28, Bone::kRightUpperArm},
     {"RightLowerArm", 29, Bone::kRightLowerArm},
     {"RightHand", 30, Bone::kRightHand},
     {"RightThumbProximal", 31, Bone::kRightThumbMetacarpal},
     {"RightThumbIntermediate", 32, Bone::kRightThumbProximal},
     {"RightThumbDistal", 33, Bone::kRightThumbDistal},
     {"RightIndexProximal", 31, Bone::kRightIndexProximal},
     {"RightIndexIntermediate", 35, Bone::kRightIndexIntermediate},
     {"RightIndexDistal", 36, Bone::kRightIndexDistal},
     {"RightMiddleProximal", 31, Bone::kRightMiddleProximal},
     {"RightMiddleIntermediate", 38, Bone::kRightMiddleIntermediate},
     {"RightMiddleDistal", 39, Bone::kRightMiddleDistal},
     {"RightRingProximal", 31, Bone::kRightRingProximal},
     {"RightRingIntermediate", 41, Bone::kRightRingIntermediate},
     {"RightRingDistal", 42, Bone::kRightRingDistal},
     {"RightLittleProximal", 31, Bone::kRightLittleProximal},
     {"RightLittleIntermediate", 44, Bone::kRightLittleIntermediate},
     {"RightLittleDistal", 45, Bone::kRightLittleDistal},
     {"LeftUpperLeg", 0, Bone::kLeftUpperLeg},
     {"LeftLowerLeg", 47, Bone::kLeftLowerLeg},
     {"LeftFoot", 48, Bone::kLeftFoot},
     {"LeftToes", 49, Bone::kLeftToes},
     {"RightUpperLeg", 0, Bone::kRightUpperLeg},
     {"RightLowerLeg", 51, Bone::kRightLowerLeg},
     {"RightFoot", 52, Bone::kRightFoot},
     {"RightToes", 53, Bone::kRightToes}}};

}  // namespace

RT_SAFE const std::array<BoneEntry, kBoneCount>& bone_table() noexcept { return kVmcBones; }

RT_SAFE std::size_t find_bone(std::string_view name) noexcept {
  const auto matches = [name](const BoneEntry& entry) {
    constexpr char kSmall = 'a' - 'A';
    return name.size() == entry.name.size() && !name.empty() &&
           name.substr(1) == entry.name.substr(1) &&
           (name[0] == entry.name[0] || name[0] == entry.name[0] + kSmall);
  };
  return std::ranges::find_if(kVmcBones, matches) - kVmcBones.begin();
}

}  // namespace posed::drivers::vmc
