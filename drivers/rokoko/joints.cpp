#include "drivers/rokoko/joints.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace posed::drivers::rokoko {
namespace {

using Reference = std::array<float, 4>;  // w, x, y, z
constexpr Reference kHip{-1.0F, 0.0F, 0.0F, 0.0F};
constexpr Reference kTrunk{0.0F, 0.0F, 0.0F, -1.0F};
constexpr Reference kLeftShoulder{-0.70711F, 0.0F, 0.0F, 0.70711F};
constexpr Reference kLeftArm{-0.5F, -0.5F, -0.5F, 0.5F};
constexpr Reference kLeftThumbRoot{-0.0923F, -0.56098F, -0.70106F, 0.43046F};
constexpr Reference kLeftThumb{-0.2706F, -0.65328F, -0.65328F, 0.2706F};
constexpr Reference kRightShoulder{0.70711F, 0.0F, 0.0F, 0.70711F};
constexpr Reference kRightArm{0.5F, 0.5F, -0.5F, 0.5F};
constexpr Reference kRightThumbRoot{0.0923F, 0.56099F, -0.70106F, 0.43046F};
constexpr Reference kRightThumb{0.2706F, 0.65328F, -0.65328F, 0.2706F};
constexpr Reference kLeftLeg{0.70711F, 0.0F, 0.70711F, 0.0F};
constexpr Reference kLeftFoot{0.0F, 0.0F, 0.70711F, -0.70711F};
constexpr Reference kRightLeg{0.70711F, 0.0F, -0.70711F, 0.0F};
constexpr Reference kRightFoot{0.0F, 0.0F, -0.70711F, 0.70711F};

constexpr std::array<StudioJoint, kStudioJoints> kJoints{{
    {"hip", -1, Bone::kHips, kHip},
    {"spine", 0, Bone::kSpine, kTrunk},
    {"chest", 1, Bone::kChest, kTrunk},
    {"neck", 2, Bone::kNeck, kTrunk},
    {"head", 3, Bone::kHead, kTrunk},
    {"leftShoulder", 2, Bone::kLeftShoulder, kLeftShoulder},
    {"leftUpperArm", 5, Bone::kLeftUpperArm, kLeftArm},
    {"leftLowerArm", 6, Bone::kLeftLowerArm, kLeftArm},
    {"leftHand", 7, Bone::kLeftHand, kLeftArm},
    {"leftThumbProximal", 8, Bone::kLeftThumbMetacarpal, kLeftThumbRoot},
    {"leftThumbMedial", 9, Bone::kLeftThumbProximal, kLeftThumb},
    {"leftThumbDistal", 10, Bone::kLeftThumbDistal, kLeftThumb},
    {"leftThumbTip", 11, {}, kLeftThumb},
    {"leftIndexProximal", 8, Bone::kLeftIndexProximal, kLeftArm},
    {"leftIndexMedial", 13, Bone::kLeftIndexIntermediate, kLeftArm},
    {"leftIndexDistal", 14, Bone::kLeftIndexDistal, kLeftArm},
    {"leftIndexTip", 15, {}, kLeftArm},
    {"leftMiddleProximal", 8, Bone::kLeftMiddleProximal, kLeftArm},
    {"leftMiddleMedial", 17, Bone::kLeftMiddleIntermediate, kLeftArm},
    {"leftMiddleDistal", 18, Bone::kLeftMiddleDistal, kLeftArm},
    {"leftMiddleTip", 19, {}, kLeftArm},
    {"leftRingProximal", 8, Bone::kLeftRingProximal, kLeftArm},
    {"leftRingMedial", 21, Bone::kLeftRingIntermediate, kLeftArm},
    {"leftRingDistal", 22, Bone::kLeftRingDistal, kLeftArm},
    {"leftRingTip", 23, {}, kLeftArm},
    {"leftLittleProximal", 8, Bone::kLeftLittleProximal, kLeftArm},
    {"leftLittleMedial", 25, Bone::kLeftLittleIntermediate, kLeftArm},
    {"leftLittleDistal", 26, Bone::kLeftLittleDistal, kLeftArm},
    {"leftLittleTip", 27, {}, kLeftArm},
    {"rightShoulder", 2, Bone::kRightShoulder, kRightShoulder},
    {"rightUpperArm", 29, Bone::kRightUpperArm, kRightArm},
    {"rightLowerArm", 30, Bone::kRightLowerArm, kRightArm},
    {"rightHand", 31, Bone::kRightHand, kRightArm},
    {"rightThumbProximal", 32, Bone::kRightThumbMetacarpal, kRightThumbRoot},
    {"rightThumbMedial", 33, Bone::kRightThumbProximal, kRightThumb},
    {"rightThumbDistal", 34, Bone::kRightThumbDistal, kRightThumb},
    {"rightThumbTip", 35, {}, kRightThumb},
    {"rightIndexProximal", 32, Bone::kRightIndexProximal, kRightArm},
    {"rightIndexMedial", 37, Bone::kRightIndexIntermediate, kRightArm},
    {"rightIndexDistal", 38, Bone::kRightIndexDistal, kRightArm},
    {"rightIndexTip", 39, {}, kRightArm},
    {"rightMiddleProximal", 32, Bone::kRightMiddleProximal, kRightArm},
    {"rightMiddleMedial", 41, Bone::kRightMiddleIntermediate, kRightArm},
    {"rightMiddleDistal", 42, Bone::kRightMiddleDistal, kRightArm},
    {"rightMiddleTip", 43, {}, kRightArm},
    {"rightRingProximal", 32, Bone::kRightRingProximal, kRightArm},
    {"rightRingMedial", 45, Bone::kRightRingIntermediate, kRightArm},
    {"rightRingDistal", 46, Bone::kRightRingDistal, kRightArm},
    {"rightRingTip", 47, {}, kRightArm},
    {"rightLittleProximal", 32, Bone::kRightLittleProximal, kRightArm},
    {"rightLittleMedial", 49, Bone::kRightLittleIntermediate, kRightArm},
    {"rightLittleDistal", 50, Bone::kRightLittleDistal, kRightArm},
    {"rightLittleTip", 51, {}, kRightArm},
    {"leftUpLeg", 0, Bone::kLeftUpperLeg, kLeftLeg},
    {"leftLeg", 53, Bone::kLeftLowerLeg, kLeftLeg},
    {"leftFoot", 54, Bone::kLeftFoot, kLeftFoot},
    {"leftToe", 55, Bone::kLeftToes, kLeftFoot},
    {"leftToeEnd", 56, {}, kLeftFoot},
    {"rightUpLeg", 0, Bone::kRightUpperLeg, kRightLeg},
    {"rightLeg", 58, Bone::kRightLowerLeg, kRightLeg},
    {"rightFoot", 59, Bone::kRightFoot, kRightFoot},
    {"rightToe", 60, Bone::kRightToes, kRightFoot},
    {"rightToeEnd", 61, {}, kRightFoot},
}};

// The names of Apple's ARKit, in the order of the vendor's plugin.
constexpr std::array<std::string_view, kFaceValues> kFace{
    "eyeBlinkLeft",      "eyeLookDownLeft",    "eyeLookInLeft",
    "eyeLookOutLeft",    "eyeLookUpLeft",      "eyeSquintLeft",
    "eyeWideLeft",       "eyeBlinkRight",      "eyeLookDownRight",
    "eyeLookInRight",    "eyeLookOutRight",    "eyeLookUpRight",
    "eyeSquintRight",    "eyeWideRight",       "jawForward",
    "jawLeft",           "jawRight",           "jawOpen",
    "mouthClose",        "mouthFunnel",        "mouthPucker",
    "mouthLeft",         "mouthRight",         "mouthSmileLeft",
    "mouthSmileRight",   "mouthFrownLeft",     "mouthFrownRight",
    "mouthDimpleLeft",   "mouthDimpleRight",   "mouthStretchLeft",
    "mouthStretchRight", "mouthRollLower",     "mouthRollUpper",
    "mouthShrugLower",   "mouthShrugUpper",    "mouthPressLeft",
    "mouthPressRight",   "mouthLowerDownLeft", "mouthLowerDownRight",
    "mouthUpperUpLeft",  "mouthUpperUpRight",  "browDownLeft",
    "browDownRight",     "browInnerUp",        "browOuterUpLeft",
    "browOuterUpRight",  "cheekPuff",          "cheekSquintLeft",
    "cheekSquintRight",  "noseSneerLeft",      "noseSneerRight",
    "tongueOut"};

constexpr std::array<std::string_view, kStudioJoints> kJointNames = [] {
  std::array<std::string_view, kStudioJoints> names{};
  for (std::size_t j = 0; j < names.size(); ++j) names[j] = kJoints[j].name;
  return names;
}();

// [place in the order of the alphabet] index of the name
template <std::size_t count>
constexpr auto sorted_names(const std::array<std::string_view, count>& names) {
  std::array<std::uint8_t, count> order{};
  for (std::size_t i = 0; i < count; ++i) order[i] = static_cast<std::uint8_t>(i);
  std::ranges::sort(order, {}, [&names](std::uint8_t i) { return names[i]; });
  return order;
}
constexpr auto kSortedJoints = sorted_names(kJointNames);
constexpr auto kSortedFace = sorted_names(kFace);

template <std::size_t count>
RT_SAFE std::size_t index_of(std::string_view name,
                             const std::array<std::string_view, count>& names,
                             const std::array<std::uint8_t, count>& order) noexcept {
  const auto at =
      std::ranges::lower_bound(order, name, {}, [&names](std::uint8_t i) { return names[i]; });
  return at != order.end() && names[*at] == name ? *at : count;
}

}  // namespace

RT_SAFE const StudioJoint& studio_joint(std::size_t joint) noexcept { return kJoints[joint]; }
RT_SAFE std::string_view face_value_name(std::size_t value) noexcept { return kFace[value]; }
RT_SAFE std::size_t joint_named(std::string_view name) noexcept {
  return index_of(name, kJointNames, kSortedJoints);
}
RT_SAFE std::size_t face_value_named(std::string_view name) noexcept {
  return index_of(name, kFace, kSortedFace);
}

RT_SAFE JointSet fingers_of(std::size_t hand) noexcept {
  JointSet fingers;
  for (std::size_t i = 1; i <= kFingerJointsOfHand; ++i) fingers.set(hand + i);
  return fingers;
}

RT_SAFE int parent_among(const JointSet& joints, std::size_t joint) noexcept {
  int parent = kJoints[joint].parent;
  while (parent >= 0 && !joints[parent]) {
    parent = kJoints[parent].parent;
  }
  return parent;
}

RT_SAFE JointSet connected(const JointSet& joints) noexcept {
  JointSet kept;
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (joints[j]) kept[j] = kept.none() || parent_among(kept, j) >= 0;
  }
  return kept;
}

Quatf t_pose_rotation(std::size_t joint) noexcept {
  const auto& [w, x, y, z] = kJoints[joint].reference_wxyz;
  const float length = std::sqrt(w * w + x * x + y * y + z * z);
  return mirrored(Quatf{x / length, y / length, z / length, w / length});
}

}  // namespace posed::drivers::rokoko
