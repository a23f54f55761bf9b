// The mean pose of a figure over a clip.
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "proto/clip/clip.hpp"

namespace posed::clip {

// Mean global rotation of each joint [joint], with the heading of each frame (from the line between
// the upper legs) removed. Input of t_frames_from_mean_pose(), when the figure walks or stands in
// the clip.
[[nodiscard]] std::vector<Eigen::Quaterniond> mean_rotations(const Clip& clip);

}  // namespace posed::clip
