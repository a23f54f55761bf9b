#include "proto/clip/mean_pose.hpp"

#include <cmath>

namespace posed::clip {
namespace {

// The line from the right to the left upper leg in the hips' frame; zero when either is unknown.
Eigen::Vector3d hip_line(const Skeleton& skeleton) {
  const int left = skeleton.joint_of(Bone::kLeftUpperLeg);
  const int right = skeleton.joint_of(Bone::kRightUpperLeg);
  if (left < 0 || right < 0) return Eigen::Vector3d::Zero();
  return skeleton.joints[left].offset_m - skeleton.joints[right].offset_m;
}

}  // namespace

std::vector<Eigen::Quaterniond> mean_rotations(const Clip& clip) {
  const Skeleton& skeleton = *clip.skeleton;
  const Eigen::Vector3d line = hip_line(skeleton);
  const int hips = std::max(skeleton.joint_of(Bone::kHips), 0);
  std::vector<Eigen::Quaterniond> global(skeleton.joints.size());
  std::vector<Eigen::Vector4d> sum(skeleton.joints.size(), Eigen::Vector4d::Zero());
  for (int i = 0; i < clip.frames(); ++i) {
    const auto row = clip.channels.row(i);
    const std::span<const double> values(row.data(), static_cast<std::size_t>(row.size()));
    for (int j = 0; j < std::ssize(skeleton.joints); ++j) {
      const int parent = skeleton.joints[j].parent;
      const Eigen::Quaterniond local = local_rotation(skeleton, j, values);
      global[j] = parent < 0 ? local : global[parent] * local;
    }
    // Left is +X when the figure faces +Z.
    const Eigen::Vector3d left = global[hips] * line;
    const Eigen::Quaterniond back = axis_rotation(Axis::kY, std::atan2(left.z(), left.x()));
    for (std::size_t j = 0; j < global.size(); ++j) {
      const Eigen::Vector4d q = (back * global[j]).coeffs();
      sum[j] += q.dot(sum[j]) < 0 ? Eigen::Vector4d(-q) : q;
    }
  }
  for (std::size_t j = 0; j < global.size(); ++j) {
    global[j] = sum[j].norm() > 1e-9 ? Eigen::Quaterniond(sum[j].normalized())
                                     : Eigen::Quaterniond::Identity();
  }
  return global;
}

}  // namespace posed::clip
