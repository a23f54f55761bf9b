// The motion of emulated bodies from a clip of a person.
#pragma once

#include <filesystem>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/emulator.hpp"
#include "proto/frame/result.hpp"

namespace posed::emulate {

// Every person of `emulator` performs the clip, retargeted to its skeleton, interpolated
// between frames and repeated in a loop; bodies that share no bone with the clip, such as props,
// move as before. Without any person it is an error. Cold.
[[nodiscard]] Result<Motion> clip_motion(const std::filesystem::path& path,
                                         const drivers::Emulator& emulator);

}  // namespace posed::emulate
