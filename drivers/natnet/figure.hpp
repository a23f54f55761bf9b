// Bodies as Motive builds them: an average person, for the emulator and for outputs, and what the
// emulator streams, which is such a person with fingers and a wand with markers. Cold.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/natnet/model_def.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers::natnet {

// All lengths times `scale`; offsets in posed's axes.
[[nodiscard]] BodyDef average_person(const std::string& name, std::int32_t id, float scale,
                                     bool fingers);
// The skeleton that posed makes of a body with such offsets.
Result<std::shared_ptr<const Skeleton>> skeleton_of(const BodyDef& body);

inline constexpr std::int32_t kPersonId = 1;
inline constexpr std::int32_t kWandId = 2;

// The positions of the wand's markers in its own frame.
inline constexpr std::array<Vec3f, 4> kWandMarkers_m{
    {{0.0F, 0.0F, 0.0F}, {0.1F, 0.0F, 0.0F}, {0.0F, 0.2F, 0.0F}, {0.0F, 0.0F, 0.3F}}};

// Body 0 is the person, 1 the wand; offsets in posed's axes.
[[nodiscard]] ModelDef emulated_model();

}  // namespace posed::drivers::natnet
