// FBX, which posed reads in another process: the program posed-fbx beside it, which has limits and
// no rights, hands the motion over as .glb. Cold.
#pragma once

#include "proto/clip/format.hpp"

namespace posed::clip {

// Its row of the table of clip formats, which the commands add when they start (add_format).
[[nodiscard]] Format fbx_format();

}  // namespace posed::clip
