#include "models/perform/standing.hpp"

#include <algorithm>
#include <limits>

#include "proto/frame/rotation.hpp"

namespace posed::perform {

using Eigen::Vector3d;

Standing::Standing(const Skeleton& skeleton) {
  const auto chain_to = [&skeleton](int joint) {
    Chain chain;
    while (joint >= 0) {
      const Joint& link = skeleton.joints[joint];
      chain.push_back({.joint = joint, .offset_m = link.offset_m});
      joint = link.parent;
    }
    std::ranges::reverse(chain);
    return chain;
  };
  root_ = chain_to(skeleton.root_joint);
  feet_ = {chain_to(skeleton.joint_of(Bone::kLeftFoot)),
           chain_to(skeleton.joint_of(Bone::kRightFoot))};
}

// From the top joint, which is the same for root and feet.
RT_SAFE Vector3d Standing::place_m(const Chain& chain, const Frame& frame) noexcept {
  Vector3d place = Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  for (std::size_t i = 0; i < chain.size(); ++i) {
    if (i > 0) place += rotation * chain[i].offset_m;
    const std::size_t joint = chain[i].joint;
    rotation = rotation * to_eigen_double(frame.rotation_xyzw[joint]);
  }
  return place;
}

RT_SAFE Standing::Feet Standing::feet_m(const Frame& frame) const noexcept {
  Vector3d root;
  for (int i = 0; i < 3; ++i) root[i] = frame.root_position_m[i];
  const Vector3d shift = root - place_m(root_, frame);
  Feet feet;
  for (std::size_t f = 0; f < feet.size(); ++f) {
    feet[f].setConstant(std::numeric_limits<double>::quiet_NaN());
    if (!feet_[f].empty()) feet[f] = place_m(feet_[f], frame) + shift;
  }
  return feet;
}

RT_SAFE double Standing::stand(const Feet& places_m, Frame& frame) const noexcept {
  const Feet feet = feet_m(frame);
  Vector3d shift = Vector3d::Zero();
  double count = 0.0;
  for (std::size_t f = 0; f < feet.size(); ++f) {
    const Vector3d off = places_m[f] - feet[f];
    if (!off.allFinite()) continue;
    shift += off;
    count += 1.0;
  }
  if (count == 0.0) return 0.0;
  shift /= count;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.root_position_m[axis] += static_cast<float>(shift[static_cast<Eigen::Index>(axis)]);
  }
  double off_m = 0.0;
  for (std::size_t f = 0; f < feet.size(); ++f) {
    const Vector3d off = feet[f] + shift - places_m[f];
    if (off.allFinite()) off_m = std::max(off_m, off.norm());
  }
  return off_m;
}

}  // namespace posed::perform
