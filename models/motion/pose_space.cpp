#include "models/motion/pose_space.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <ranges>
#include <span>

#include "models/motion/cmu43.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::motion {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

bool turns(const Skeleton& skeleton, int joint) {
  return std::ranges::any_of(skeleton.channels, [joint](const Channel& channel) {
    return channel.joint == joint && !channel.translation;
  });
}

bool below(const Skeleton& skeleton, int joint, int ancestor) {
  for (int j = joint; j >= 0; j = skeleton.joints[j].parent) {
    if (j == ancestor) return true;
  }
  return false;
}

// Each Acclaim joint turns in a frame of its own; a BVH converted from such a figure keeps a known
// list of joint names.
bool is_acclaim(const Skeleton& skeleton) {
  const int arm = skeleton.joint_index("lhumerus");
  return arm >= 0 && std::abs(skeleton.joints[arm].channel_frame.w()) < 0.99;
}

int find_joint(const PoseSpaceSpec& spec, std::size_t i, const Skeleton& skeleton) {
  const std::string& name = spec.joints[i];
  if (spec.space == Space::kHumanoid) {
    const auto bone = bone_from_name(name);
    return bone ? skeleton.joint_of(*bone) : -1;
  }
  if (spec.space == Space::kCmu43) {
    return skeleton.joint_index(is_acclaim(skeleton) ? kCmu43[i].asf : kCmu43[i].bvh);
  }
  return skeleton.joint_index(name);
}

std::vector<int> find_joints(const PoseSpaceSpec& spec, const Skeleton& skeleton) {
  std::vector<int> joints(spec.joints.size());
  for (std::size_t i = 0; i < joints.size(); ++i) joints[i] = find_joint(spec, i, skeleton);
  return joints;
}

// Those of the missing joints that `counts`.
std::vector<std::string> missing_of(const PoseSpaceSpec& spec, const std::vector<int>& joints,
                                    const auto& counts) {
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i] < 0 && counts(spec.joints[i])) missing.push_back(spec.joints[i]);
  }
  return missing;
}

// A figure without hips, or without any of a pair, is no person whose manner of walking could be
// changed; one of a pair is enough, as for who has lost an arm.
using CorePair = std::array<Bone, 2>;
constexpr std::array kCore{CorePair{Bone::kHips, Bone::kHips},
                           CorePair{Bone::kLeftUpperArm, Bone::kRightUpperArm},
                           CorePair{Bone::kLeftLowerArm, Bone::kRightLowerArm},
                           CorePair{Bone::kLeftUpperLeg, Bone::kRightUpperLeg},
                           CorePair{Bone::kLeftLowerLeg, Bone::kRightLowerLeg}};

bool has_any(const Skeleton& skeleton, const CorePair& pair) {
  return std::ranges::any_of(pair, [&](Bone bone) { return skeleton.joint_of(bone) >= 0; });
}

// Whether the bone is one of a pair of which the skeleton has none.
bool is_needed(std::string_view name, const Skeleton& skeleton) {
  const auto bone = bone_from_name(name);
  return std::ranges::any_of(kCore, [&](const CorePair& pair) {
    return bone && std::ranges::find(pair, *bone) != pair.end() && !has_any(skeleton, pair);
  });
}

std::unexpected<Error> missing_joints(const PoseSpaceSpec& spec,
                                      const std::vector<std::string>& missing,
                                      const Skeleton& skeleton) {
  constexpr std::size_t kNamed = 12;
  std::string names = joined(missing | std::views::take(kNamed), ", ", clean_name);
  if (missing.size() > kNamed) {
    names += " and " + std::to_string(missing.size() - kNamed) + " more";
  }
  return fail("skeleton " + in_quotes(skeleton.name) + " cannot serve pose space " +
              std::string(space_name(spec.space)) + ": it has no joint " + names +
              "; use a source of the kind the model was trained on, or train with --pose-space "
              "humanoid");
}

Result<> check_spec(const PoseSpaceSpec& spec) {
  const bool means_fit =
      spec.space == Space::kCmu43 ? spec.mean.empty() : spec.mean.size() == spec.joints.size();
  const bool joints_fit =
      spec.space == Space::kCmu43 ? spec.joints.size() == kCmu43.size() : !spec.joints.empty();
  const bool root_fits = spec.root >= 0 && spec.root < static_cast<int>(spec.joints.size());
  if (means_fit && joints_fit && root_fits && space_dims(spec) <= kMaxPoseDims) return {};
  return fail("the pose space " + std::string(space_name(spec.space)) +
              " does not fit its joints; train the model again");
}

}  // namespace

std::string_view space_name(Space space) {
  switch (space) {
    case Space::kCmu43:
      return "cmu43";
    case Space::kHumanoid:
      return "humanoid";
    case Space::kNative:
      break;
  }
  return "native";
}

Result<Space> space_from_name(std::string_view name) {
  for (const Space space : {Space::kNative, Space::kCmu43, Space::kHumanoid}) {
    if (name == space_name(space)) return space;
  }
  return misuse("no pose space is called " + in_quotes(name) +
                "; choose native, cmu43 or humanoid");
}

bool is_person(const Skeleton& skeleton) {
  return std::ranges::all_of(kCore, [&](const CorePair& pair) { return has_any(skeleton, pair); });
}

int space_dims(const PoseSpaceSpec& spec) {
  return spec.space == Space::kCmu43 ? 43 : 3 * static_cast<int>(spec.joints.size());
}

Result<PoseSpaceSpec> describe_space(Space space, const Skeleton& skeleton) {
  PoseSpaceSpec spec;
  spec.space = space;
  if (space == Space::kCmu43) {
    for (const Cmu43Joint& joint : kCmu43) spec.joints.emplace_back(joint.asf);
  } else {
    for (int j = 0; j < static_cast<int>(skeleton.joints.size()); ++j) {
      const Joint& joint = skeleton.joints[j];
      if (!below(skeleton, j, skeleton.root_joint) || !turns(skeleton, j)) continue;
      if (space == Space::kNative) spec.joints.push_back(joint.name);
      if (space == Space::kHumanoid && joint.bone) spec.joints.emplace_back(bone_name(*joint.bone));
    }
    spec.mean.assign(spec.joints.size(), Quaterniond::Identity());
  }
  TRY(PoseSpace::bind(spec, skeleton));
  return spec;
}

Result<PoseSpace> PoseSpace::bind(const PoseSpaceSpec& spec, const Skeleton& skeleton) {
  TRY(check_spec(spec));
  const std::vector<int> joints = find_joints(spec, skeleton);
  const auto missing = missing_of(spec, joints, [](const std::string& /*name*/) { return true; });
  if (!missing.empty()) return missing_joints(spec, missing, skeleton);
  return bind_joints(spec, skeleton, joints);
}

Result<PoseSpace> PoseSpace::bind_person(const PoseSpaceSpec& spec, const Skeleton& skeleton) {
  if (spec.space != Space::kHumanoid) return bind(spec, skeleton);
  TRY(check_spec(spec));
  const std::vector<int> joints = find_joints(spec, skeleton);
  const std::string& root = spec.joints[spec.root];
  const auto needed = missing_of(spec, joints, [&](const std::string& name) {
    return name == root || is_needed(name, skeleton);
  });
  if (!needed.empty()) return missing_joints(spec, needed, skeleton);
  return bind_joints(spec, skeleton, joints);
}

PoseSpace PoseSpace::bind_joints(const PoseSpaceSpec& spec, const Skeleton& skeleton,
                                 const std::vector<int>& joints) {
  PoseSpace space;
  space.skeleton_ = std::make_shared<const Skeleton>(skeleton);
  space.root_ = spec.root;
  space.euler_ = spec.space == Space::kCmu43;
  space.missing_ = missing_of(spec, joints, [](const std::string& /*name*/) { return true; });
  for (std::size_t i = 0; i < joints.size(); ++i) {
    Item item;
    item.joint = joints[i];
    item.first_dim = static_cast<int>(space.joint_of_dim_.size());
    if (item.joint >= 0) space.set_chain(spec, joints, item);
    if (space.euler_) {
      item.axes = kCmu43[i].axes;
      item.dims = std::popcount(static_cast<unsigned>(item.axes));
      item.after = cmu43_axis_frame(kCmu43[i]);
      item.before = item.after.conjugate();
    } else {
      item.mean = item.own_mean = spec.mean[i];
    }
    space.joint_of_dim_.insert(space.joint_of_dim_.end(), item.dims, static_cast<int>(i));
    space.items_.push_back(item);
  }
  if (!space.missing_.empty()) space.set_lost(spec, joints);
  return space;
}

// The root's rotation is relative to the world, a humanoid bone's to the next bone of the space
// above it, so that a rig with an additional joint in between gives the same bone rotations.
void PoseSpace::set_chain(const PoseSpaceSpec& spec, const std::vector<int>& joints, Item& item) {
  const bool is_root = item.joint == joints[spec.root];
  item.chain_begin = static_cast<int>(chain_.size());
  int parent = skeleton_->joints[item.joint].parent;
  if (is_root || spec.space == Space::kHumanoid) {
    while (parent >= 0 && (is_root || std::ranges::find(joints, parent) == joints.end())) {
      chain_.insert(chain_.begin() + item.chain_begin, parent);
      parent = skeleton_->joints[parent].parent;
    }
  }
  item.chain_end = static_cast<int>(chain_.size());
  if (spec.space != Space::kHumanoid) return;
  if (parent >= 0) item.before = skeleton_->joints[parent].T_world_joint;
  item.after = skeleton_->joints[item.joint].T_world_joint.conjugate();
}

void PoseSpace::set_lost(const PoseSpaceSpec& spec, const std::vector<int>& joints) {
  const std::vector<float> at_rest(joint_of_dim_.size(), 0.0F);
  for (std::size_t i = 0; i < items_.size(); ++i) {
    Item& item = items_[i];
    item.lost_begin = static_cast<int>(lost_.size());
    auto above = parent_of(*bone_from_name(spec.joints[i]));
    for (; item.joint >= 0 && above; above = parent_of(*above)) {
      const auto found = std::ranges::find(spec.joints, bone_name(*above));
      if (found == spec.joints.end()) continue;
      const auto index = found - spec.joints.begin();
      if (joints[index] >= 0) break;
      lost_.insert(lost_.begin() + item.lost_begin, static_cast<int>(index));
    }
    item.lost_end = static_cast<int>(lost_.size());
    item.mean = turned_mean(item, std::span<const float>(at_rest));
  }
}

int PoseSpace::dims() const noexcept { return static_cast<int>(joint_of_dim_.size()); }
int PoseSpace::joint_of_dim(int d) const noexcept { return joint_of_dim_[d]; }
int PoseSpace::skeleton_joint_of_dim(int d) const noexcept {
  return items_[joint_of_dim_[d]].joint;
}

RT_SAFE bool PoseSpace::chain_measured(const Item& item, const Frame& frame) const noexcept {
  bool all = item.joint >= 0 && item.joint < frame.joint_count;
  for (int i = item.chain_begin; i < item.chain_end; ++i) all = all && frame.valid[chain_[i]];
  return all;
}

RT_SAFE bool PoseSpace::measured(const Item& item, const Frame& frame) const noexcept {
  return chain_measured(item, frame) && frame.valid[item.joint];
}

// The product of all factors before L in V, without the mean.
RT_SAFE Quaterniond PoseSpace::base(const Item& item, const Frame& frame,
                                    double heading_rad) const noexcept {
  Quaterniond rotation = item.before;
  if (&item == &items_[root_]) rotation = axis_rotation(Axis::kY, -heading_rad) * rotation;
  for (int i = item.chain_begin; i < item.chain_end; ++i) {
    rotation = rotation * to_eigen_double(frame.rotation_xyzw[chain_[i]]);
  }
  return rotation;
}

RT_SAFE bool PoseSpace::has_heading(const Frame& frame) const noexcept {
  return measured(items_[root_], frame);
}

RT_SAFE double PoseSpace::heading_rad(const Frame& frame) const noexcept {
  const Item& root = items_[root_];
  const Quaterniond now =
      base(root, frame, 0.0) * to_eigen_double(frame.rotation_xyzw[root.joint]) * root.after;
  // Ry(psi) mean is nearest to `now` where the dot product of the two quaternions is largest.
  return twist_angle_rad(Quaterniond(now * root.mean.conjugate()), unit(Axis::kY));
}

RT_SAFE void PoseSpace::to_vector(const Frame& frame, double heading_rad, std::span<float> q,
                                  std::span<std::uint8_t> available) const noexcept {
  for (const Item& item : items_) {
    const bool here = measured(item, frame);
    Vector3d value = Vector3d::Zero();
    if (here) {
      const Quaterniond rotation = item.mean.conjugate() * base(item, frame, heading_rad) *
                                   to_eigen_double(frame.rotation_xyzw[item.joint]) * item.after;
      value = euler_ ? euler_xyz_rad(rotation) : rotation_log(rotation);
    }
    int d = item.first_dim;
    for (int axis = 0; axis < 3; ++axis) {
      if (((item.axes >> axis) & 1) == 0) continue;
      q[d] = static_cast<float>(value[axis]);
      available[d] = here ? 1 : 0;
      ++d;
    }
  }
}

RT_SAFE bool PoseSpace::convert(const PoseSpace& from, std::span<const float> from_q,
                                std::span<float> q) const noexcept {
  const auto same = [](const Item& a, const Item& b) {
    return a.joint == b.joint && a.axes == b.axes && a.before.coeffs() == b.before.coeffs();
  };
  if (euler_ != from.euler_ || root_ != from.root_ ||
      !std::ranges::equal(items_, from.items_, same)) {
    return false;
  }
  if (euler_) {
    std::ranges::copy(from_q.first(joint_of_dim_.size()), q.begin());
    return true;
  }
  for (std::size_t i = 0; i < items_.size(); ++i) {
    const std::size_t d = items_[i].first_dim;
    const Vector3d v(from_q[d], from_q[d + 1], from_q[d + 2]);
    const Vector3d w = rotation_log(
        Quaterniond(items_[i].mean.conjugate() * from.items_[i].mean * rotation_exp(v)));
    for (std::size_t axis = 0; axis < 3; ++axis)
      q[d + axis] = static_cast<float>(w[static_cast<int>(axis)]);
  }
  return true;
}

// V after the change; `rotation` is V as the frame has it, which Euler angles alone need.
RT_SAFE Quaterniond PoseSpace::changed(const Item& item, const Quaterniond& rotation,
                                       const float* q, const float* delta) const noexcept {
  // A joint may turn about an axis that the space does not list (cmu43); that angle is kept.
  Vector3d now = euler_ ? euler_xyz_rad(rotation) : Vector3d::Zero();
  Vector3d change = Vector3d::Zero();
  for (int axis = 0, d = 0; axis < 3; ++axis) {
    if (((item.axes >> axis) & 1) == 0) continue;
    now[axis] = q[d];
    change[axis] = delta[d];
    ++d;
  }
  if (!euler_) return rotation_exp(Vector3d(now + change));
  if (std::abs(now.y()) + std::abs(change.y()) < kMaxMiddleAngle_rad) {
    return rotation_from_euler_xyz(now + change);
  }
  return rotation_exp(euler_change_as_vector(now, change)) * rotation_from_euler_xyz(now);
}

template <typename T>
RT_SAFE Quaterniond PoseSpace::turned_mean(const Item& item, std::span<const T> q) const noexcept {
  if (item.lost_begin == item.lost_end) return item.mean;
  Quaterniond mean = Quaterniond::Identity();
  for (int i = item.lost_begin; i < item.lost_end; ++i) {
    const Item& lost = items_[lost_[i]];
    const Vector3d v(q[lost.first_dim], q[lost.first_dim + 1], q[lost.first_dim + 2]);
    mean = mean * lost.own_mean * rotation_exp(v);
  }
  return mean * item.own_mean;
}

RT_SAFE void PoseSpace::add(Frame& frame, double heading_rad, std::span<const float> q,
                            std::span<const float> delta) const noexcept {
  for (const Item& item : items_) {
    const auto change = delta.subspan(item.first_dim, item.dims);
    const Quaterniond mean = turned_mean(item, delta);
    const bool moves = std::ranges::any_of(change, [](float d) { return d != 0.0F; }) ||
                       mean.coeffs() != item.mean.coeffs();
    if (!moves || !measured(item, frame)) continue;
    const Quaterniond from_base = base(item, frame, heading_rad);
    Quaterniond now = Quaterniond::Identity();
    if (euler_) {
      now = item.mean.conjugate() * from_base * to_eigen_double(frame.rotation_xyzw[item.joint]) *
            item.after;
    }
    const Quaterniond local = from_base.conjugate() * mean *
                              changed(item, now, &q[item.first_dim], change.data()) *
                              item.after.conjugate();
    set_rotation(*skeleton_, item.joint, local, frame);
  }
}

RT_SAFE void PoseSpace::put(Frame& frame, double heading_rad,
                            std::span<const double> q) const noexcept {
  assert(!euler_);
  for (const Item& item : items_) {
    const std::size_t d = item.first_dim;
    const Vector3d v(q[d], q[d + 1], q[d + 2]);
    const Quaterniond mean = turned_mean(item, q);
    const bool known = v.allFinite() && mean.coeffs().allFinite();
    if (!known || !chain_measured(item, frame)) continue;
    const Quaterniond local = base(item, frame, heading_rad).conjugate() * mean * rotation_exp(v) *
                              item.after.conjugate();
    frame.valid[item.joint] = true;
    set_rotation(*skeleton_, item.joint, local, frame);
  }
}

}  // namespace posed::motion
