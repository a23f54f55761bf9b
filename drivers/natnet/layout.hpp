// The bodies of a NatNet server, compiled from its description.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/frame/humanoid.hpp"

namespace posed::drivers::natnet {

// Returns the bone that has this name in Motive's own convention, without the skeleton's name:
// "LUArm". Cold.
[[nodiscard]] std::optional<Bone> motive_bone(std::string_view name);

// The table by which the decoder reads one body.
struct BodyTable {
  std::int32_t id = 0;
  bool is_skeleton = false;
  std::vector<std::uint16_t> bone_ids{};  // [joint], without the skeleton's id
  std::vector<int> parents{};             // [joint]
  std::vector<Vec3f> offsets_m{};         // [joint], in posed's axes
  std::size_t markers = 0;                // their numbers are 1 to this

  // The index of the bone's joint; bone_ids.size() when there is none. `guess` is looked at first.
  RT_SAFE [[nodiscard]] std::size_t joint_of(std::uint16_t bone_id,
                                             std::size_t guess) const noexcept;
};

class NatNetLayout final : public SourceLayout {
 public:
  std::vector<BodyTable> tables;  // [body]

  // The index of a body; bodies.size() when there is no such body.
  RT_SAFE [[nodiscard]] std::size_t body_of(bool is_skeleton, std::int32_t id) const noexcept;
};

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

}  // namespace posed::drivers::natnet
