#include "models/style/live/hinges.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/frame/smooth_step.hpp"

namespace posed::style {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kGives_rad = 3.0 * kDegree;       // a hinge gives softly by up to so much
constexpr double kOtherwise_rad = 20.0 * kDegree;  // bent back by more is no hinge of a person
constexpr double kPerhaps_rad = 10.0 * kDegree;    // up to here it surely is

}  // namespace

Hinges::Hinges(const Skeleton& skeleton) : skeleton_(&skeleton) {
  const auto add = [&](Bone above, Bone bone, const Vector3d& axis, const Vector3d& straight) {
    const int joint = skeleton.joint_of(bone);
    if (joint < 0 || skeleton.joint_of(above) < 0) return;
    const auto j = static_cast<std::size_t>(joint);
    hinges_.push_back({.joint = joint,
                       .above = T_above(skeleton, j),
                       .below = skeleton.joints[j].T_world_joint.conjugate(),
                       .axis = axis,
                       .straight = straight});
  };
  add(Bone::kLeftUpperLeg, Bone::kLeftLowerLeg, Vector3d::UnitX(), -Vector3d::UnitY());
  add(Bone::kRightUpperLeg, Bone::kRightLowerLeg, Vector3d::UnitX(), -Vector3d::UnitY());
  add(Bone::kLeftUpperArm, Bone::kLeftLowerArm, -Vector3d::UnitY(), Vector3d::UnitX());
  add(Bone::kRightUpperArm, Bone::kRightLowerArm, Vector3d::UnitY(), -Vector3d::UnitX());
}

RT_SAFE double Hinges::Hinge::bend_rad(std::span<const Quatf> rotations) const noexcept {
  const Quaterniond local = to_eigen_double(rotations[static_cast<std::size_t>(joint)]);
  const Vector3d points = above * (local * (below * straight));
  return std::atan2(points.dot(axis.cross(straight)), points.dot(straight));
}

RT_SAFE double Hinges::hold(std::span<const Quatf> in, Frame& styled) const noexcept {
  double most_rad = 0.0;
  for (const Hinge& hinge : hinges_) {
    const auto j = static_cast<std::size_t>(hinge.joint);
    if (j >= styled.joint_count || !styled.valid[j]) continue;
    const double own_rad = hinge.bend_rad(in);
    const double allowed_rad = std::min(0.0, own_rad);
    const double over_rad =
        allowed_rad - unwrap_near(hinge.bend_rad(styled.rotation_xyzw), own_rad);
    if (!(over_rad > 0.0)) continue;
    const double is_hinge =
        smooth_step((kOtherwise_rad + allowed_rad) / (kOtherwise_rad - kPerhaps_rad));
    const double back_rad =
        is_hinge * (over_rad - kGives_rad * (1.0 - std::exp(-over_rad / kGives_rad)));
    if (!(back_rad > 0.0)) continue;
    const Quaterniond back(Eigen::AngleAxisd(back_rad, hinge.axis));
    const Quaterniond local = to_eigen_double(styled.rotation_xyzw[j]);
    set_rotation(*skeleton_, hinge.joint, hinge.above.conjugate() * back * hinge.above * local,
                 styled);
    most_rad = std::max(most_rad, back_rad);
  }
  return most_rad;
}

}  // namespace posed::style
