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

}  // namespace posed
