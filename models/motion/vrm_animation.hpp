// A clip of a person as VRM animation (.vrma), which avatar programs play on any VRM figure. Cold.
#pragma once

#include <filesystem>

#include "proto/clip/format.hpp"
#include "proto/frame/result.hpp"

namespace posed::motion {

// Writes glTF with the extension VRMC_vrm_animation 1.0: the canonical humanoid of the clip's
// skeleton stands in T-pose on the ground, with the person's proportions; every bone that there is
// turns, the fingers too, and the hips move. Fails for a skeleton without a bone that VRM requires,
// and names those that are missing.
Result<> write_vrm_animation(const clip::Clip& clip, const std::filesystem::path& path);

// Its row of the table of clip formats, which the program adds when it starts (clip::add_format).
[[nodiscard]] clip::Format vrm_animation_format();

}  // namespace posed::motion
