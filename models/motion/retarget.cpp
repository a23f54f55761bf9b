#include "models/motion/retarget.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"

namespace posed::motion {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// No person or figure is larger than another by more; legs of such a skeleton are a mistake.
constexpr double kMaxScale = 50.0;

// The length of the leg's parts that both skeletons have.
struct Legs {
  double from_m = 0.0, to_m = 0.0;
};

// Distance between two joints in the zero pose, along the chain from `bone` up to `above`; nullopt
// where the skeleton has no such chain.
std::optional<double> length_m(const Skeleton& skeleton, Bone above, Bone bone) {
  const int top = skeleton.joint_of(above);
  int joint = skeleton.joint_of(bone);
  if (top < 0 || joint < 0) return std::nullopt;
  double sum_m = 0.0;
  while (joint >= 0 && joint != top) {
    sum_m += skeleton.joints[joint].offset_m.norm();
    joint = skeleton.joints[joint].parent;
  }
  if (joint < 0) return std::nullopt;
  return sum_m;
}

Legs leg_lengths(const Skeleton& from, const Skeleton& to) {
  constexpr std::array<std::pair<Bone, Bone>, 4> kParts{
      {{Bone::kLeftUpperLeg, Bone::kLeftLowerLeg},
       {Bone::kLeftLowerLeg, Bone::kLeftFoot},
       {Bone::kRightUpperLeg, Bone::kRightLowerLeg},
       {Bone::kRightLowerLeg, Bone::kRightFoot}}};
  Legs legs;
  for (const auto& [above, bone] : kParts) {
    const auto source_m = length_m(from, above, bone);
    const auto target_m = length_m(to, above, bone);
    if (!source_m || !target_m) continue;
    legs.from_m += *source_m;
    legs.to_m += *target_m;
  }
  return legs;
}

using Rotations = std::array<Quaterniond, kMaxJoints>;  // [joint], joint's frame to the world

// The offset from the skeleton's root joint to `joint`, a joint below it, in the world.
RT_SAFE Vector3d from_root(const Skeleton& skeleton, const Rotations& world, int joint) noexcept {
  Vector3d offset_m = Vector3d::Zero();
  while (joint >= 0 && joint != skeleton.root_joint) {
    const Joint& here = skeleton.joints[joint];
    if (here.parent < 0) return Vector3d::Zero();  // the hips lie above the root joint
    offset_m += world[here.parent] * here.offset_m;
    joint = here.parent;
  }
  return offset_m;
}

}  // namespace

Result<Retarget> Retarget::bind(std::shared_ptr<const Skeleton> from,
                                std::shared_ptr<const Skeleton> to) {
  Retarget retarget;
  bool common = false;
  for (const Joint& joint : to->joints) {
    Part part{.source = joint.bone ? from->joint_of(*joint.bone) : -1,
              .before = Quaterniond::Identity(),
              .after = joint.T_world_joint};
    if (part.source >= 0) {
      part.before = from->joints[static_cast<std::size_t>(part.source)].T_world_joint.conjugate();
      common = true;
    }
    retarget.parts_.push_back(part);
  }
  if (!common) {
    return fail("skeleton " + in_quotes(from->name) + " and " + in_quotes(to->name) +
                " have no bone in common; name the joints as VRM does (hips, leftUpperArm, ...)");
  }
  const Legs legs = leg_lengths(*from, *to);
  const double scale = legs.to_m / legs.from_m;  // not finite without legs
  if (scale > 1.0 / kMaxScale && scale < kMaxScale) retarget.scale_ = scale;
  retarget.angles_ = static_cast<std::uint16_t>(std::ranges::count_if(
      to->channels, [](const Channel& channel) { return !channel.translation; }));
  retarget.from_ = std::move(from);
  retarget.to_ = std::move(to);
  return retarget;
}

RT_SAFE void Retarget::apply(const Frame& in, Frame& out) const noexcept {
  Rotations source, target;
  for (std::size_t j = 0; j < from_->joints.size(); ++j) {
    const int parent = from_->joints[j].parent;
    const Quaterniond local = to_eigen_double(in.rotation_xyzw[j]);
    source[j] = parent < 0 ? local : source[parent] * local;
  }
  copy_all_but_pose(in, out);
  out.skeleton = to_->id;
  out.joint_count = static_cast<std::uint16_t>(to_->joints.size());
  out.angle_count = angles_;
  out.valid.reset();
  // C is the rotation of a joint in the world relative to its T-pose: G = C T.
  Rotations C;
  for (std::size_t j = 0; j < parts_.size(); ++j) {
    const Part& part = parts_[j];
    const int above = to_->joints[j].parent;
    const std::size_t parent = above < 0 ? 0 : above;
    const std::size_t from = part.source < 0 ? 0 : part.source;
    const bool measured = part.source >= 0 && part.source < in.joint_count && in.valid[from];
    if (measured) {
      C[j] = source[from] * part.before;
    } else {
      C[j] = above < 0 ? Quaterniond::Identity() : C[parent];
    }
    target[j] = C[j] * part.after;
    const Quaterniond local = above < 0 ? target[j] : target[parent].conjugate() * target[j];
    set_rotation(*to_, static_cast<int>(j), local, out);  // which normalises it
    out.valid[j] = measured;
  }
  const int hips = from_->joint_of(Bone::kHips), hips_there = to_->joint_of(Bone::kHips);
  Vector3d position_m(in.root_position_m[0], in.root_position_m[1], in.root_position_m[2]);
  if (hips >= 0 && hips_there >= 0) position_m += from_root(*from_, source, hips);
  position_m *= scale_;
  if (hips >= 0 && hips_there >= 0) position_m -= from_root(*to_, target, hips_there);
  for (int i = 0; i < 3; ++i) {
    out.root_position_m[i] = static_cast<float>(position_m[i]);
  }
}

}  // namespace posed::motion
