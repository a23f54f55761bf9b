// Turns a walk that goes about a stage into one that goes straight on: training sees a clip from
// one heading, and who walks for 20 s in a room must turn. Cold.
#pragma once

#include "proto/clip/clip.hpp"

namespace posed::style {

// Takes out of all frames how far the body has turned since the first one, by the pelvis without
// the sway of its strides. A clip that keeps its heading within 30 degrees, or whose skeleton has
// none, stays as it is. All values must be finite.
void straighten(clip::Clip& clip);

}  // namespace posed::style
