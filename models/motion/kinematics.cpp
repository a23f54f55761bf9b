#include "models/motion/kinematics.hpp"

#include "proto/frame/rotation.hpp"

namespace posed::motion {

WorldPose world_pose(const Skeleton& skeleton, const Frame& frame) {
  const std::size_t count = skeleton.joints.size();
  WorldPose pose{.rotation = std::vector<Eigen::Quaterniond>(count),
                 .position_m = std::vector<Eigen::Vector3d>(count, Eigen::Vector3d::Zero())};
  for (std::size_t j = 0; j < count; ++j) {
    const Joint& joint = skeleton.joints[j];
    const Eigen::Quaterniond local = to_eigen_double(frame.rotation_xyzw[j]);
    pose.rotation[j] = joint.parent < 0 ? local : pose.rotation[joint.parent] * local;
    if (joint.parent >= 0) {
      pose.position_m[j] =
          pose.position_m[joint.parent] + pose.rotation[joint.parent] * joint.offset_m;
    }
  }
  // The offsets above the root joint only give where the recording began; the true root position is
  // the frame's.
  Eigen::Vector3d root;
  for (int i = 0; i < 3; ++i) root[i] = frame.root_position_m[i];
  const Eigen::Vector3d shift = root - pose.position_m[skeleton.root_joint];
  for (Eigen::Vector3d& position : pose.position_m) position += shift;
  return pose;
}

}  // namespace posed::motion
