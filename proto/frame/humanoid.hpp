// The canonical humanoid: VRM / Unity bone names, a body plus fifteen finger joints per hand. In
// T-pose every rotation is identity, the person faces +Z and the left hand points to +X.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace posed {

enum class Bone : std::uint8_t {
  kHips,
  kSpine,
  kChest,
  kUpperChest,
  kNeck,
  kHead,
  kLeftShoulder,
  kLeftUpperArm,
  kLeftLowerArm,
  kLeftHand,
  kRightShoulder,
  kRightUpperArm,
  kRightLowerArm,
  kRightHand,
  kLeftUpperLeg,
  kLeftLowerLeg,
  kLeftFoot,
  kLeftToes,
  kRightUpperLeg,
  kRightLowerLeg,
  kRightFoot,
  kRightToes,
  kLeftThumbMetacarpal,
  kLeftThumbProximal,
  kLeftThumbDistal,
  kLeftIndexProximal,
  kLeftIndexIntermediate,
  kLeftIndexDistal,
  kLeftMiddleProximal,
  kLeftMiddleIntermediate,
  kLeftMiddleDistal,
  kLeftRingProximal,
  kLeftRingIntermediate,
  kLeftRingDistal,
  kLeftLittleProximal,
  kLeftLittleIntermediate,
  kLeftLittleDistal,
  kRightThumbMetacarpal,
  kRightThumbProximal,
  kRightThumbDistal,
  kRightIndexProximal,
  kRightIndexIntermediate,
  kRightIndexDistal,
  kRightMiddleProximal,
  kRightMiddleIntermediate,
  kRightMiddleDistal,
  kRightRingProximal,
  kRightRingIntermediate,
  kRightRingDistal,
  kRightLittleProximal,
  kRightLittleIntermediate,
  kRightLittleDistal,
  kCount
};
inline constexpr int kBones = static_cast<int>(Bone::kCount);

// "hips", "leftUpperArm", ... as VRM spells them.
[[nodiscard]] std::string_view bone_name(Bone bone);
[[nodiscard]] std::optional<Bone> bone_from_name(std::string_view name);

// The bone that carries this one in a figure that has them all; none for the hips.
[[nodiscard]] std::optional<Bone> parent_of(Bone bone);

}  // namespace posed
