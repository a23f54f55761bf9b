// What training sees of a recording: every frame with how it changes (models/gesture/README.md,
// "Features"). Cold.
#pragma once

#include <Eigen/Core>

namespace posed::gesture {

// One frame a row, so that a stretch of time is one block of memory.
using FeatureMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// [frame][channel] -> [frame][window][channel]: the value, delta (-1/2, 0, 1/2) and delta-delta
// (1, -2, 1). Taken over the whole recording, before any cut; its first and last frame are their
// own missing neighbours.
[[nodiscard]] FeatureMatrix features_of(const FeatureMatrix& values);

}  // namespace posed::gesture
