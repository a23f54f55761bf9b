// The joints of a frame as robotics programs know them: each in its parent, in the axes of ROS: x
// forward, y left, z up.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

inline constexpr const char* kRosWorld = "world";  // the parent of a joint without one

struct RosFrame {
  Eigen::Vector3d position_m;
  Eigen::Quaterniond turn;
};

// [joint]. Cold: allocates.
[[nodiscard]] std::vector<RosFrame> ros_frames(const Skeleton& skeleton, const Frame& frame);

// The names of the frames, STREAM/JOINT. [joint]
[[nodiscard]] std::vector<std::string> ros_frame_names(const std::string& stream,
                                                       const Skeleton& skeleton);

}  // namespace posed::motion
