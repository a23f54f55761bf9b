#include "models/motion/leg_signal.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/rotation.hpp"

namespace posed::motion {

using Eigen::Quaterniond;
using Eigen::Vector3d;

std::optional<LegSignal> LegSignal::find(const Skeleton& skeleton) {
  const int right = skeleton.joint_of(Bone::kRightUpperLeg);
  const int left = skeleton.joint_of(Bone::kLeftUpperLeg);
  if (left < 0 || right < 0) return std::nullopt;
  return LegSignal(skeleton, right, left);
}

LegSignal::LegSignal(const Skeleton& skeleton, int right, int left) {
  const auto thigh_of = [&](int j) {
    const Joint& joint = skeleton.joints[j];
    const Quaterniond before =
        joint.parent < 0 ? Quaterniond::Identity() : skeleton.joints[joint.parent].T_world_joint;
    return Thigh{static_cast<std::size_t>(j), before, joint.T_world_joint.conjugate()};
  };
  thighs_ = {thigh_of(right), thigh_of(left)};
}

RT_SAFE bool LegSignal::measured(const Frame& frame) const noexcept {
  return std::ranges::all_of(thighs_, [&](const Thigh& thigh) {
    return thigh.joint < frame.joint_count && frame.valid[thigh.joint];
  });
}

// The thigh points down in the T-pose; its flexion is how far forward it points in the pelvis
// frame.
RT_SAFE double LegSignal::value_rad(const Frame& frame) const noexcept {
  const auto flexion_rad = [&](const Thigh& thigh) {
    const Quaterniond canonical =
        thigh.before * to_eigen_double(frame.rotation_xyzw[thigh.joint]) * thigh.after;
    const Vector3d down = canonical * -Vector3d::UnitY();
    return std::atan2(down.z(), -down.y());
  };
  return flexion_rad(thighs_[0]) - flexion_rad(thighs_[1]);
}

}  // namespace posed::motion
