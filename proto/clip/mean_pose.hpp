// The pose in which a figure stands on average over a clip.
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "proto/clip/clip.hpp"

namespace posed::clip {

// Mean global rotation of each joint, the heading of each frame (from the line between the upper
// legs) removed. For t_frames_from_standing(), where the clip walks or stands.
[[nodiscard]] std::vector<Eigen::Quaterniond> standing_rotations(const Clip& clip);

}  // namespace posed::clip
