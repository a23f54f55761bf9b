// The bodies that the emulator streams: a person as Motive's skeletons are built, with fingers, and
// a wand with markers. Cold.
#pragma once

#include <array>

#include "drivers/natnet/model_def.hpp"

namespace posed::drivers::natnet {

inline constexpr std::int32_t kPersonId = 1;
inline constexpr std::int32_t kWandId = 2;

// The positions of the wand's markers in its own frame.
inline constexpr std::array<Vec3f, 4> kWandMarkers_m{
    {{0.0F, 0.0F, 0.0F}, {0.1F, 0.0F, 0.0F}, {0.0F, 0.2F, 0.0F}, {0.0F, 0.0F, 0.3F}}};

// Body 0 is the person, 1 the wand; offsets in posed's axes.
[[nodiscard]] ModelDef emulated_model();

}  // namespace posed::drivers::natnet
