// The feature vectors of a recording: each frame's values with their delta and delta-delta
// (models/gesture/README.md, "Features"). Cold.
#pragma once

#include <Eigen/Core>

namespace posed::gesture {

// One row per frame, so that consecutive frames are one block of memory.
using FeatureMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// [frame][channel] -> [frame][window][channel]: the value, delta (-1/2, 0, 1/2) and delta-delta (1,
// -2, 1). They are computed over the whole recording, before any cut; a missing neighbour of the
// first or last frame is that frame itself.
[[nodiscard]] FeatureMatrix features_of(const FeatureMatrix& values);

}  // namespace posed::gesture
