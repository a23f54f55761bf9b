// How far a held pose may lie from a recorded label's and still be that gesture, learnt from people
// who are left out of training one at a time (models/gesture/README.md, "None"). Cold.
#pragma once

#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"

namespace posed::gesture {

// `recordings` have segments of each of `labels` that is trained, and of no other label.
[[nodiscard]] HeldPoses held_poses(const std::vector<Recording>& recordings,
                                   const std::vector<Label>& labels);

}  // namespace posed::gesture
