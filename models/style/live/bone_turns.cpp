#include "models/style/live/bone_turns.hpp"

#include <algorithm>
#include <utility>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::style {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kClear = 0.3;  // shorter sums of directions point nowhere

// The bones of the arms that have a direction, and the one that each leads to.
constexpr std::array<std::pair<Bone, Bone>, 4> kArms{{{Bone::kLeftUpperArm, Bone::kLeftLowerArm},
                                                      {Bone::kLeftLowerArm, Bone::kLeftHand},
                                                      {Bone::kRightUpperArm, Bone::kRightLowerArm},
                                                      {Bone::kRightLowerArm, Bone::kRightHand}}};

bool is_of_hand(Bone bone) {
  return bone == Bone::kLeftHand || bone == Bone::kRightHand || bone >= Bone::kLeftThumbMetacarpal;
}

int depth_of(Bone bone) {
  int depth = 0;
  for (auto above = parent_of(bone); above; above = parent_of(*above)) ++depth;
  return depth;
}

// Towards the joint of the next bone, past joints that are no bones; empty where there is none.
std::optional<Vector3d> direction_of(const Skeleton& skeleton, int joint, Bone next) {
  Vector3d to_m = Vector3d::Zero();
  int j = skeleton.joint_of(next);
  for (; j >= 0 && j != joint; j = skeleton.joints[j].parent) to_m += skeleton.joints[j].offset_m;
  if (j != joint || !(to_m.norm() > 0.0)) return std::nullopt;
  return to_m.normalized();
}

}  // namespace

std::optional<BoneTurns> BoneTurns::make(const motion::PoseSpaceSpec& spec,
                                         const Skeleton& skeleton) {
  if (spec.space != motion::Space::kHumanoid) return std::nullopt;
  std::vector<std::pair<Bone, int>> order;  // with the place in the spec
  for (std::size_t i = 0; i < spec.joints.size(); ++i) {
    order.emplace_back(*bone_from_name(spec.joints[i]), static_cast<int>(i));
  }
  std::ranges::stable_sort(order, {}, [](const auto& one) { return depth_of(one.first); });
  const auto find = [&](std::optional<Bone> bone) {
    const auto at =
        std::ranges::find_if(order, [&](const auto& one) { return bone && one.first == *bone; });
    return at == order.end() ? -1 : static_cast<int>(at - order.begin());
  };
  BoneTurns turns;
  turns.skeleton_ = skeleton;
  for (const auto& [bone, place] : order) {
    auto above = parent_of(bone);
    while (above && find(above) < 0) above = parent_of(*above);
    turns.taught_.push_back({.parent = find(above),
                             .first_dim = 3 * place,
                             .mean = spec.mean[static_cast<std::size_t>(place)]});
  }
  for (int j = 0; j < static_cast<int>(skeleton.joints.size()); ++j) {
    Part& part = turns.parts_.emplace_back();
    const auto bone = skeleton.joints[j].bone;
    if (!bone || skeleton.joint_of(*bone) != j) continue;
    part.bone = find(bone);
    part.rides = part.bone < 0 || is_of_hand(*bone);
    const auto arm = std::ranges::find(kArms, *bone, [](const auto& one) { return one.first; });
    if (arm == kArms.end()) continue;
    part.along = direction_of(skeleton, j, arm->second);
    part.in_t_pose = arm - kArms.begin() < 2 ? Vector3d::UnitX() : Vector3d(-Vector3d::UnitX());
  }
  return turns;
}

// How each bone of the training's figure is turned in the world, in both poses.
RT_SAFE void BoneTurns::find_taught(std::span<const float> from, std::span<const float> change,
                                    Turns& before, Turns& after) const noexcept {
  for (std::size_t b = 0; b < taught_.size(); ++b) {
    const Taught& bone = taught_[b];
    const auto d = static_cast<std::size_t>(bone.first_dim);
    const Vector3d pose(from[d], from[d + 1], from[d + 2]);
    const Vector3d step(change[d], change[d + 1], change[d + 2]);
    before[b] = bone.mean * rotation_exp(pose);
    after[b] = bone.mean * rotation_exp(Vector3d(pose + step));
    if (bone.parent < 0) continue;
    before[b] = before[static_cast<std::size_t>(bone.parent)] * before[b];
    after[b] = after[static_cast<std::size_t>(bone.parent)] * after[b];
  }
}

// Where the walker's joint is turned as `own`. An arm's direction gets the taught change of
// direction, and its twist follows.
RT_SAFE Quaterniond BoneTurns::turn_of(const Part& part, const Quaterniond& own,
                                       const Quaterniond& before,
                                       const Quaterniond& after) const noexcept {
  if (part.along) {
    const Vector3d now = own * *part.along;
    const Vector3d then = now + after * part.in_t_pose - before * part.in_t_pose;
    if (then.norm() > kClear) return minimal_rotation(now, then.normalized());
  }
  return after * before.conjugate();
}

RT_SAFE void BoneTurns::add(Frame& frame, double heading_rad, std::span<const float> from,
                            std::span<const float> change,
                            std::span<const float> shares) const noexcept {
  Turns before, after;
  find_taught(from, change, before, after);
  const Quaterniond seen = axis_rotation(Axis::kY, -heading_rad);
  Turns pose, turn;  // of each joint, seen from the heading
  for (std::size_t j = 0; j < parts_.size() && j < frame.joint_count; ++j) {
    const int above = skeleton_.joints[j].parent;
    const auto p = static_cast<std::size_t>(std::max(above, 0));
    const Quaterniond local = to_eigen_double(frame.rotation_xyzw[j]);
    const Quaterniond carried = above < 0 ? Quaterniond::Identity() : turn[p];
    pose[j] = (above < 0 ? seen : pose[p]) * local;
    turn[j] = carried;
    const Part& part = parts_[j];
    if (part.rides || !frame.valid[j]) continue;
    const auto b = static_cast<std::size_t>(part.bone);
    const double share = shares[static_cast<std::size_t>(taught_[b].first_dim)];
    if (share == 0.0) continue;
    turn[j] = turn_of(part, pose[j], before[b], after[b]);
    const Quaterniond own = carried.conjugate() * turn[j];
    if (share < 1.0) turn[j] = carried * rotation_exp(Vector3d(share * rotation_log(own)));
    const Quaterniond base = above < 0 ? seen : pose[p];
    const Quaterniond styled = (carried * base).conjugate() * turn[j] * pose[j];
    set_rotation(skeleton_, static_cast<int>(j), styled, frame);
  }
}

}  // namespace posed::style
