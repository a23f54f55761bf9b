// Labels of a take that holds one movement: rest, the way up, a hold, the way down. The movement's
// segment lasts from its onset until the way down begins, where that of the rest begins; what comes
// before the movement has no label (models/gesture/README.md, "One movement a clip"). Cold.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/gesture/recording.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// How the movement's hold is labelled: as one segment with the way up, or so that it can be
// performed for as long as one likes: cut at each cycle of a hold that oscillates, as a wave does,
// and once in the middle of one that is still. All parts have the movement's label.
enum class Hold : std::uint8_t { kWhole, kCycles };

// Two segments, or more with Hold::kCycles; `movement` and `rest` are their labels. Returns an
// error for a take that does not leave its first pose and come back to it.
Result<std::vector<Segment>> propose_movement(const Recording& recording,
                                              const std::string& movement, const std::string& rest,
                                              Hold hold = Hold::kWhole);

// How a movement oscillates: along the direction in which its poses scatter most.
struct Oscillation {
  double deviation_rad = 0.0;  // norm over all channels
  std::vector<int> cycles;     // frames at which a cycle begins
  bool steady = false;         // it has cycles of nearly equal length, and is no tremor
};
// Measures the oscillation in the frames [from, to).
[[nodiscard]] Oscillation oscillation_in(const Recording& recording, int from, int to);

}  // namespace posed::gesture
