#include "models/motion/ros_frames.hpp"

#include <cstddef>

#include "models/motion/kinematics.hpp"

namespace posed::motion {

std::vector<RosFrame> ros_frames(const Skeleton& skeleton, const Frame& frame) {
  const WorldPose pose = world_pose(skeleton, frame);
  std::vector<RosFrame> frames;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const bool top = joint.parent < 0;
    const Eigen::Vector3d& at = top ? pose.position_m[j] : joint.offset_m;
    const Eigen::Quaterniond turn =
        top ? pose.rotation[j] : pose.rotation[joint.parent].conjugate() * pose.rotation[j];
    // posed's x is left, y up, z forward.
    frames.push_back(
        {.position_m = {at.z(), at.x(), at.y()}, .turn = {turn.w(), turn.z(), turn.x(), turn.y()}});
  }
  return frames;
}

std::vector<std::string> ros_frame_names(const std::string& stream, const Skeleton& skeleton) {
  std::vector<std::string> names;
  for (const Joint& joint : skeleton.joints) names.push_back(stream + "/" + joint.name);
  return names;
}

}  // namespace posed::motion
