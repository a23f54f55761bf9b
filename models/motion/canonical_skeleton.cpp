#include "models/motion/canonical_skeleton.hpp"

#include <string>
#include <vector>

#include "proto/frame/humanoid.hpp"
#include "proto/text/clean.hpp"

namespace posed::motion {
namespace {

Result<std::shared_ptr<const Skeleton>> bones_of(const Skeleton& skeleton, Bone root, bool in_t) {
  const int top = skeleton.joint_of(root);
  if (top < 0) {
    return fail("skeleton " + in_quotes(skeleton.name) + " has no " + std::string(bone_name(root)) +
                (root == Bone::kHips ? ", so it is no person's" : "") +
                "; name its joints as VRM does");
  }
  auto canonical = std::make_shared<Skeleton>();
  canonical->name = "humanoid of " + skeleton.name;
  const std::size_t count = skeleton.joints.size();
  std::vector<Eigen::Vector3d> position_m(count, Eigen::Vector3d::Zero());
  const auto turn = [&](std::size_t j) {
    return in_t ? skeleton.joints[j].T_world_joint : Eigen::Quaterniond::Identity();
  };
  std::vector<int> place(count, -1);  // the joint of `canonical` that is this one or above it
  for (std::size_t j = 0; j < count; ++j) {
    const Joint& from = skeleton.joints[j];
    if (from.parent >= 0) {
      const std::size_t parent = from.parent;
      position_m[j] = position_m[parent] + turn(parent) * from.offset_m;
      place[j] = place[parent];
    } else if (!in_t) {
      position_m[j] = from.offset_m;
    }
    // Joints above the root are left out; so is a bone that hangs beside it.
    const bool is_root = static_cast<int>(j) == top;
    if (!from.bone || (!is_root && place[j] < 0)) continue;
    Joint joint;
    joint.name = bone_name(*from.bone);
    joint.parent = place[j];
    joint.bone = from.bone;
    if (joint.parent >= 0) {
      const Bone above = *canonical->joints[joint.parent].bone;
      joint.offset_m = position_m[j] - position_m[skeleton.joint_of(above)];
    } else if (!in_t) {
      joint.offset_m = position_m[j];
    }
    if (from.end_site_m) joint.end_site_m = turn(j) * *from.end_site_m;
    if (!in_t) joint.T_world_joint = from.T_world_joint;
    place[j] = static_cast<int>(canonical->joints.size());
    canonical->joints.push_back(std::move(joint));
  }
  TRY(canonical->finish());
  return canonical;
}

}  // namespace

Result<std::shared_ptr<const Skeleton>> canonical_skeleton(const Skeleton& skeleton, Bone root) {
  return bones_of(skeleton, root, true);
}

Result<std::shared_ptr<const Skeleton>> resting_skeleton(const Skeleton& skeleton, Bone root) {
  return bones_of(skeleton, root, false);
}

}  // namespace posed::motion
