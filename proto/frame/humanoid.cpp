#include "proto/frame/humanoid.hpp"

#include <array>

namespace posed {
namespace {

constexpr std::array<std::string_view, kBones> kNames{"hips",
                                                      "spine",
                                                      "chest",
                                                      "upperChest",
                                                      "neck",
                                                      "head",
                                                      "leftShoulder",
                                                      "leftUpperArm",
                                                      "leftLowerArm",
                                                      "leftHand",
                                                      "rightShoulder",
                                                      "rightUpperArm",
                                                      "rightLowerArm",
                                                      "rightHand",
                                                      "leftUpperLeg",
                                                      "leftLowerLeg",
                                                      "leftFoot",
                                                      "leftToes",
                                                      "rightUpperLeg",
                                                      "rightLowerLeg",
                                                      "rightFoot",
                                                      "rightToes",
                                                      "leftThumbMetacarpal",
                                                      "leftThumbProximal",
                                                      "leftThumbDistal",
                                                      "leftIndexProximal",
                                                      "leftIndexIntermediate",
                                                      "leftIndexDistal",
                                                      "leftMiddleProximal",
                                                      "leftMiddleIntermediate",
                                                      "leftMiddleDistal",
                                                      "leftRingProximal",
                                                      "leftRingIntermediate",
                                                      "leftRingDistal",
                                                      "leftLittleProximal",
                                                      "leftLittleIntermediate",
                                                      "leftLittleDistal",
                                                      "rightThumbMetacarpal",
                                                      "rightThumbProximal",
                                                      "rightThumbDistal",
                                                      "rightIndexProximal",
                                                      "rightIndexIntermediate",
                                                      "rightIndexDistal",
                                                      "rightMiddleProximal",
                                                      "rightMiddleIntermediate",
                                                      "rightMiddleDistal",
                                                      "rightRingProximal",
                                                      "rightRingIntermediate",
                                                      "rightRingDistal",
                                                      "rightLittleProximal",
                                                      "rightLittleIntermediate",
                                                      "rightLittleDistal"};

}  // namespace

std::string_view bone_name(Bone bone) { return kNames.at(static_cast<std::size_t>(bone)); }

std::optional<Bone> bone_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == name) return static_cast<Bone>(i);
  }
  return std::nullopt;
}

std::optional<Bone> parent_of(Bone bone) {
  switch (bone) {
    case Bone::kHips:
      return std::nullopt;
    case Bone::kLeftUpperLeg:
    case Bone::kRightUpperLeg:
      return Bone::kHips;
    case Bone::kLeftShoulder:
    case Bone::kRightShoulder:
      return Bone::kUpperChest;
    default:
      break;
  }
  const std::string_view name = bone_name(bone);
  const bool is_finger = bone >= Bone::kLeftThumbMetacarpal;
  const bool is_thumb = name.find("Thumb") != std::string_view::npos;
  if (is_finger && name.ends_with(is_thumb ? "Metacarpal" : "Proximal")) {
    return bone < Bone::kRightThumbMetacarpal ? Bone::kLeftHand : Bone::kRightHand;
  }
  return static_cast<Bone>(static_cast<int>(bone) - 1);
}

}  // namespace posed
