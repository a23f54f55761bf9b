// Labelling aid: from a few labelled examples it proposes segments for the whole recording, which a
// person then corrects. The change from one label's pose to another's is found by the nearest
// labelled pose over time; the start of that move is found by its motion energy
// (models/gesture/README.md, "Proposed labels"). Two gestures of the same label in a row look like
// one. Cold.
#pragma once

#include <vector>

#include "models/gesture/recording.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// `recording.segments` are the examples, one or more of each label; they are returned unchanged
// among the proposals. Where in a move the person puts the border is learnt from the examples.
// Returns an error for examples of fewer than two labels and for poses that are all alike.
Result<std::vector<Segment>> propose_segments(const Recording& recording);

}  // namespace posed::gesture
