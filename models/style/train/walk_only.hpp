// What of a recording is the walk: without who stands before and after it, and without the turns of
// a walk about a room. Cold.
#pragma once

#include "models/motion/motion.hpp"

namespace posed::style {

struct Standing {
  double before_s = 0.0, after_s = 0.0;
};

// Leaves out the frames before and after the walk in which the legs stand still for at least half a
// second, T-pose or not, and says how long that is. A motion without named legs, or whose legs
// never swing, stays as it is.
Standing leave_out_standing(motion::Motion& motion);

// Turns a walk that goes about a stage into one that goes straight on: training sees a clip from
// one heading, and who walks for 20 s in a room must turn. Takes out of all frames how far the body
// has turned since the first one, by the pelvis without the sway of its strides, and returns that
// range [rad]. A motion that keeps its heading within 30 degrees, or whose skeleton has none, stays
// as it is: 0.
double straighten(motion::Motion& motion);

}  // namespace posed::style
