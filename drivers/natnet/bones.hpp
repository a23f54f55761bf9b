// The bones of Motive's skeletons by their names.
#pragma once

#include <optional>
#include <string_view>

#include "proto/frame/humanoid.hpp"

namespace posed::drivers::natnet {

// Of a name in Motive's own convention, without the skeleton's name: "LUArm". Cold.
[[nodiscard]] std::optional<Bone> motive_bone(std::string_view name);

}  // namespace posed::drivers::natnet
