#include "models/feet/legs.hpp"

#include <algorithm>

#include "proto/frame/rotation.hpp"

namespace posed::feet {
namespace {

constexpr double kNoLength_m = 0.01;  // a shorter bone gives no direction

struct LegBones {
  Bone thigh, shin, foot, toes;
};
constexpr std::array<LegBones, kLegs> kLegBones{{
    {Bone::kLeftUpperLeg, Bone::kLeftLowerLeg, Bone::kLeftFoot, Bone::kLeftToes},
    {Bone::kRightUpperLeg, Bone::kRightLowerLeg, Bone::kRightFoot, Bone::kRightToes},
}};

std::vector<int> chain_to(const Skeleton& skeleton, int joint) {
  std::vector<int> chain;
  for (int j = joint; j >= 0; j = skeleton.joints[j].parent) {
    chain.push_back(j);
  }
  std::ranges::reverse(chain);
  return chain;
}

// The sum of the offsets from `from` down to `to`, as if nothing between them turned: figures have
// no joints there.
double length_between_m(const Skeleton& skeleton, int from, int to) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int j = to; j >= 0 && j != from; j = skeleton.joints[j].parent) {
    sum += skeleton.joints[j].offset_m;
  }
  return sum.norm();
}

// The tip of a joint that has one.
Leg::Place tip_of(const Skeleton& skeleton, int joint) {
  const auto& end = skeleton.joints[joint].end_site_m;
  if (!end || end->norm() < kNoLength_m) return {};
  return {.joint = joint, .offset_m = *end};
}

// A leg that exists only if all its bones do and are one below the other.
Leg leg_of(const Skeleton& skeleton, const LegBones& bones) {
  Leg leg{.thigh = skeleton.joint_of(bones.thigh), .shin = skeleton.joint_of(bones.shin)};
  const int foot = skeleton.joint_of(bones.foot);
  if (leg.thigh < 0 || leg.shin < 0 || foot < 0) return {};
  leg.chain = chain_to(skeleton, foot);
  const auto at = [&](int joint) { return std::ranges::find(leg.chain, joint); };
  if (at(leg.thigh) >= at(leg.shin) || at(leg.shin) == leg.chain.end()) return {};
  leg.thigh_m = length_between_m(skeleton, leg.thigh, leg.shin);
  leg.shin_m = length_between_m(skeleton, leg.shin, foot);
  if (leg.thigh_m < kNoLength_m || leg.shin_m < kNoLength_m) return {};
  leg.foot = foot;
  leg.points[kAnkle].joint = foot;
  const int toes = skeleton.joint_of(bones.toes);
  if (toes >= 0) {
    leg.points[kToe].joint = toes;
    leg.points[kTip] = tip_of(skeleton, toes);
  } else {
    leg.points[kToe] = tip_of(skeleton, foot);
  }
  return leg;
}

}  // namespace

Result<Legs> Legs::find(const Skeleton& skeleton) {
  Legs legs;
  std::vector<int> needed = chain_to(skeleton, skeleton.root_joint);
  for (std::size_t i = 0; i < kLegs; ++i) {
    legs.legs_[i] = leg_of(skeleton, kLegBones[i]);
    const Leg& leg = legs.legs_[i];
    if (!leg.exists()) continue;
    legs.length_m_ = std::max(legs.length_m_, leg.thigh_m + leg.shin_m);
    for (const Leg::Place& place : leg.points) {
      const auto chain = chain_to(skeleton, place.joint);
      needed.insert(needed.end(), chain.begin(), chain.end());
    }
  }
  if (legs.length_m_ == 0.0) {
    return misuse(
        "the skeleton has no leg: the feet stage needs an upper leg, a lower leg and a foot of at"
        " least one side; leave out its [stream.feet] table, or name the joints in a profile");
  }
  std::ranges::sort(needed);
  needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
  for (const int j : needed) {
    const Joint& joint = skeleton.joints[j];
    legs.joints_.push_back({.joint = j, .parent = joint.parent, .offset_m = joint.offset_m});
  }
  legs.root_ = skeleton.root_joint;
  return legs;
}

RT_SAFE void Legs::pose(const Frame& frame, LegPose& pose) const noexcept {
  for (const Link& bone : joints_) {
    const std::size_t j = bone.joint;
    const Eigen::Quaterniond local = to_eigen_double(frame.rotation_xyzw[j]);
    if (bone.parent < 0) {
      pose.world_rotation[j] = local;
      pose.from_root_m[j].setZero();
      continue;
    }
    const std::size_t parent = bone.parent;
    pose.world_rotation[j] = pose.world_rotation[parent] * local;
    pose.from_root_m[j] = pose.from_root_m[parent] + pose.world_rotation[parent] * bone.offset_m;
  }
  const Eigen::Vector3d root = pose.from_root_m[root_];
  for (const Link& bone : joints_) pose.from_root_m[bone.joint] -= root;
  for (std::size_t i = 0; i < kLegs; ++i) {
    const Leg& leg = legs_[i];
    pose.measured[i] =
        leg.exists() && std::ranges::all_of(leg.chain, [&](int j) { return frame.valid[j]; });
    for (std::size_t p = 0; p < kPoints; ++p) {
      if (!leg.has(p)) continue;
      const std::size_t j = leg.points[p].joint;
      Eigen::Vector3d& at_m = pose.point_from_root_m[i][p];
      at_m = pose.from_root_m[j] + pose.world_rotation[j] * leg.points[p].offset_m;
      // A rotation that is none counts as not measured, whatever its flag says.
      pose.measured[i] = pose.measured[i] && at_m.allFinite();
    }
  }
}

}  // namespace posed::feet
