// Labels of a take that holds one movement: rest, the way up, a hold, the way down. The movement's
// segment lasts from its onset until the way down begins, where that of the rest begins; what comes
// before the movement has no label (models/gesture/README.md, "One movement a take"). Cold.
#pragma once

#include <string>
#include <vector>

#include "models/gesture/recording.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// Two segments; `movement` and `rest` are their labels. Returns an error for a take that does not
// leave its first pose and come back to it.
[[nodiscard]] Result<std::vector<Segment>> propose_movement(const Recording& recording,
                                                            const std::string& movement,
                                                            const std::string& rest);

}  // namespace posed::gesture
