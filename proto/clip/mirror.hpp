// A clip with left and right exchanged. Cold.
#pragma once

#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::clip {

// What the left hand did the right one does, and who walked to the left walks to the right
// (mirrored at the plane x = 0). A joint that is no bone has its partner at the mirrored place.
// Refuses a figure whose sides have other joints, and a clip of a single frame.
Result<Clip> mirrored(const Clip& clip);

}  // namespace posed::clip
