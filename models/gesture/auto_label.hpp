// Annotation help: from a few labelled examples to proposed segments for the whole recording, for a
// person to correct. Where the pose changes from one label's to another's is found by the nearest
// labelled pose over time; where that move begins, by its motion energy. Two gestures of the same
// label in a row look like one. Cold.
#pragma once

#include <vector>

#include "models/gesture/recording.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// `recording.segments` are the examples, one or more of each label; they come back unchanged among
// the proposals. Where in a move people put the border is learnt from the examples. Refuses
// examples of fewer than two labels, and poses that are all alike.
[[nodiscard]] Result<std::vector<Segment>> propose_segments(const Recording& recording);

}  // namespace posed::gesture
