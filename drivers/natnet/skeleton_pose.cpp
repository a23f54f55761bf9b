#include "drivers/natnet/skeleton_pose.hpp"

#include <array>

#include "drivers/pose_values.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::natnet {
namespace {

Eigen::Vector3d vector_of(const Vec3f& v) noexcept {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

}  // namespace

bool SkeletonPose::add(const RigidBody& bone) noexcept {
  // The low word of an id is the bone, the high word the skeleton.
  const auto id = static_cast<std::uint16_t>(static_cast<std::uint32_t>(bone.id) & 0xffff);
  const std::size_t joint = table_.joint_of(id, next_);
  next_ = joint + 1;
  undescribed_ = undescribed_ || joint >= table_.bone_ids.size();
  if (joint >= table_.bone_ids.size() || seen_[joint] || !is_plausible(bone.position_m)) {
    return false;
  }
  bool has_rotation = false;
  Quatf rotation = bone.rotation_xyzw;
  if (!accept_rotation(rotation, has_rotation)) return false;
  seen_.set(joint);
  tracked_[joint] = bone.tracked && has_rotation;
  position_m_[joint] = bone.position_m;
  rotation_xyzw_[joint] = rotation;
  return true;
}

bool SkeletonPose::looks_local() const noexcept {
  double local_m = 0.0;  // misfit of each reading
  double global_m = 0.0;
  for (std::size_t j = 1; j < table_.parents.size(); ++j) {
    const std::size_t parent = table_.parents[j];
    const Eigen::Vector3d offset_m = vector_of(table_.offsets_m[j]);
    const Eigen::Vector3d here_m = vector_of(position_m_[j]);
    const Eigen::Vector3d from_parent_m = here_m - vector_of(position_m_[parent]);
    local_m += (here_m - offset_m).norm();
    global_m += (from_parent_m - to_eigen_double(rotation_xyzw_[parent]) * offset_m).norm();
  }
  return local_m < global_m;
}

bool SkeletonPose::fill(Coordinates coordinates, Frame& frame) const noexcept {
  const std::size_t joints = table_.bone_ids.size();
  if (seen_.count() != joints) return false;
  const bool local =
      coordinates == Coordinates::kAuto ? looks_local() : coordinates == Coordinates::kLocal;
  frame.joint_count = static_cast<std::uint16_t>(joints);
  frame.root_position_m = position_m_[0];
  frame.valid = tracked_;
  frame.quality = tracked_.any() ? Quality::kMeasured : Quality::kHeld;
  // In the room. A bone that is not tracked turns with its parent, and its children are relative to
  // that.
  std::array<Eigen::Quaterniond, kMaxJoints> turned;
  for (std::size_t j = 0; j < joints; ++j) {
    const Eigen::Quaterniond above =
        j == 0 ? Eigen::Quaterniond::Identity() : turned[table_.parents[j]];
    if (!tracked_[j]) {
      frame.rotation_xyzw[j] = kIdentity;
      turned[j] = above;
    } else if (local || j == 0) {
      frame.rotation_xyzw[j] = rotation_xyzw_[j];
      turned[j] = above * to_eigen_double(rotation_xyzw_[j]);
    } else {
      turned[j] = to_eigen_double(rotation_xyzw_[j]);
      frame.rotation_xyzw[j] = from_eigen(above.conjugate() * turned[j]);
    }
  }
  return true;
}

}  // namespace posed::drivers::natnet
