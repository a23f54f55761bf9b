// The humanoid bones of the VMC protocol: Unity's HumanBodyBones, named as the protocol sends them.
// Here they stand in depth-first order, parents first, as in a Skeleton.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::drivers::vmc {

struct BoneEntry {
  std::string_view name;
  int parent = -1;           // in the humanoid; a sender may leave bones out
  std::optional<Bone> bone;  // none for the eyes and the jaw
};

inline constexpr std::size_t kBoneCount = 55;
inline constexpr std::size_t kHips = 0;

// [bone]
[[nodiscard]] const std::array<BoneEntry, kBoneCount>& bone_table() noexcept;

// kBoneCount when there is no such bone. The first letter may be small, as in VRM 1's names.
RT_SAFE [[nodiscard]] std::size_t find_bone(std::string_view name) noexcept;

}  // namespace posed::drivers::vmc
