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
// The rest of the neck by its place (models/style/README.md, "Other builds").
constexpr double kNeckByName = 0.5;
constexpr double kThinnest = 1e-3;  // a joint whose bone has no length, on the way to the head

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

// The taught bones between two places, each by its share of `whole`.
std::vector<std::pair<int, double>> between(const std::vector<std::pair<double, int>>& taught,
                                            double from, double to, double whole) {
  from = std::min(from, 1.0 - kThinnest);
  to = std::max(to, from + kThinnest);
  std::vector<std::pair<int, double>> found;
  for (std::size_t i = 0; i < taught.size(); ++i) {
    const double end = i + 1 < taught.size() ? taught[i + 1].first : 1.0;
    const double both = std::min(to, end) - std::max(from, taught[i].first);
    if (both > 0.0) found.emplace_back(taught[i].second, whole * both / (to - from));
  }
  return found;
}

// [taught bone] before and after a change.
using BoneRotations = std::span<const Quaterniond>;

RT_SAFE Quaterniond turn_between(BoneRotations before, BoneRotations after, int bone) noexcept {
  const auto i = static_cast<std::size_t>(bone);
  return after[i] * before[i].conjugate();
}

RT_SAFE Vector3d turns_by(std::span<const std::pair<int, double>> shares, BoneRotations before,
                          BoneRotations after) noexcept {
  Vector3d sum = Vector3d::Zero();
  for (const auto& [bone, share] : shares) {
    sum += share * rotation_log(turn_between(before, after, bone));
  }
  return sum;
}

void add_share(std::vector<std::pair<int, double>>& shares, int bone, double share) {
  const auto at = std::ranges::find(shares, bone, [](const auto& one) { return one.first; });
  if (at == shares.end()) {
    shares.emplace_back(bone, share);
  } else {
    at->second += share;
  }
}

}  // namespace

std::vector<double> trunk_places(const Skeleton& skeleton) {
  std::vector<double> places(skeleton.joints.size(), -1.0);
  const int hips = skeleton.joint_of(Bone::kHips);
  std::vector<std::size_t> way;  // down from the head
  int j = skeleton.joint_of(Bone::kHead);
  for (; j >= 0 && j != hips; j = skeleton.joints[way.back()].parent) {
    way.push_back(static_cast<std::size_t>(j));
  }
  double whole_m = 0.0;
  for (const std::size_t joint : way) whole_m += skeleton.joints[joint].offset_m.norm();
  if (j < 0 || !(whole_m > 0.0)) return places;
  double at = 1.0;
  for (const std::size_t joint : way) {
    places[joint] = std::max(0.0, at);
    at -= skeleton.joints[joint].offset_m.norm() / whole_m;
  }
  places[static_cast<std::size_t>(hips)] = 0.0;
  return places;
}

// Two figures divide a trunk at other places and give the same names to other parts of it, so a
// joint between the hips and the head turns as what of the taught trunk lies where its own bone
// does. What the neck turns otherwise the bones below it give back over their length, so that the
// head leans as far as the taught one. `taught`: places, upwards, and bones.
void BoneTurns::match_trunk(const std::vector<std::pair<double, int>>& taught) {
  const std::vector<double> places = trunk_places(skeleton_);
  const int hips = skeleton_.joint_of(Bone::kHips);
  const int neck = skeleton_.joint_of(Bone::kNeck);
  const int head = skeleton_.joint_of(Bone::kHead);
  const auto place = [&](int j) { return j < 0 ? -1.0 : places[static_cast<std::size_t>(j)]; };
  if (taught.size() < 2 || place(head) < 0.0) return;
  // What lies between the neck and the head rides on the neck.
  int j = place(neck) >= 0.0 ? neck : skeleton_.joints[static_cast<std::size_t>(head)].parent;
  double to = 1.0;
  for (; j != hips; j = skeleton_.joints[static_cast<std::size_t>(j)].parent) {
    Part& part = parts_[static_cast<std::size_t>(j)];
    part.turns_as = between(taught, place(j), to, 1.0);
    if (j == neck && part.bone >= 0) {
      neck_ = j;
      for (auto& [bone, share] : part.turns_as) {
        share *= 1.0 - kNeckByName;
        gives_back_.emplace_back(bone, share);
      }
      add_share(part.turns_as, part.bone, kNeckByName);
      add_share(gives_back_, part.bone, -kNeckByName);
    } else {
      part.gives_back = neck_ >= 0;
    }
    if (part.bone < 0) part.bone = taught[1].second;
    part.rides = false;
    to = place(j);
  }
  // A neck that is longer than the trunk is not given back whole, or the trunk would bend double.
  const double length = 1.0 - place(neck);
  const double back = std::min(1.0, length / std::max(place(neck) - to, kThinnest));
  for (auto& [bone, share] : gives_back_) share *= back;
}

std::optional<BoneTurns> BoneTurns::make(const motion::PoseSpaceSpec& spec,
                                         std::span<const double> places, const Skeleton& skeleton) {
  if (spec.space != motion::Space::kHumanoid) return std::nullopt;
  std::vector<std::pair<Bone, int>> order;  // with the place in the spec
  order.reserve(spec.joints.size());
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
  std::vector<std::pair<double, int>> trunk;
  for (const auto& [bone, place] : order) {
    const auto i = static_cast<std::size_t>(place);
    if (i < places.size() && places[i] >= 0.0) {
      trunk.emplace_back(places[i], static_cast<int>(turns.taught_.size()));
    }
    auto above = parent_of(bone);
    while (above && find(above) < 0) above = parent_of(*above);
    turns.taught_.push_back({.parent = find(above), .first_dim = 3 * place, .mean = spec.mean[i]});
  }
  for (int j = 0; j < static_cast<int>(skeleton.joints.size()); ++j) {
    Part& part = turns.parts_.emplace_back();
    const auto bone = skeleton.joints[j].bone;
    if (!bone || skeleton.joint_of(*bone) != j) continue;
    part.bone = find(bone);
    part.rides = part.bone < 0 || is_of_hand(*bone);
    if (!part.rides) part.turns_as = {{part.bone, 1.0}};
    const auto arm = std::ranges::find(kArms, *bone, [](const auto& one) { return one.first; });
    if (arm == kArms.end()) continue;
    part.along = direction_of(skeleton, j, arm->second);
    part.in_t_pose = arm - kArms.begin() < 2 ? Vector3d::UnitX() : Vector3d(-Vector3d::UnitX());
  }
  std::ranges::sort(trunk);
  turns.match_trunk(trunk);
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

// Where the walker's joint is turned as `own`, and the trunk leans back by `back`. An arm's
// direction gets the taught change of direction, and the arm turns about itself as the taught one
// does.
RT_SAFE Quaterniond BoneTurns::turn_of(const Part& part, const Quaterniond& own,
                                       const Vector3d& back, const Turns& before,
                                       const Turns& after) const noexcept {
  const auto turned = [&](int bone) { return turn_between(before, after, bone); };
  if (part.along) {
    const auto b = static_cast<std::size_t>(part.bone);
    const Vector3d taught = before[b] * part.in_t_pose;
    const Vector3d taught_then = after[b] * part.in_t_pose;
    const Vector3d now = own * *part.along;
    const Vector3d then = now + taught_then - taught;
    if (then.norm() > kClear) {
      const Quaterniond all = turned(part.bone);
      return minimal_rotation(all * now, then.normalized()) * all;
    }
  }
  if (part.turns_as.size() == 1 && !part.gives_back) return turned(part.turns_as.front().first);
  Vector3d sum = turns_by(part.turns_as, before, after);
  if (part.gives_back) sum += back;
  return rotation_exp(sum);
}

// As far as the neck takes part in this frame.
RT_SAFE Vector3d BoneTurns::back_of(const Frame& frame, std::span<const float> shares,
                                    const Turns& before, const Turns& after) const noexcept {
  if (neck_ < 0 || !frame.valid[static_cast<std::size_t>(neck_)]) return Vector3d::Zero();
  return share_of(parts_[static_cast<std::size_t>(neck_)], shares) *
         turns_by(gives_back_, before, after);
}

RT_SAFE double BoneTurns::share_of(const Part& part, std::span<const float> shares) const noexcept {
  const Taught& bone = taught_[static_cast<std::size_t>(part.bone)];
  return shares[static_cast<std::size_t>(bone.first_dim)];
}

RT_SAFE void BoneTurns::add(Frame& frame, double heading_rad, std::span<const float> from,
                            std::span<const float> change,
                            std::span<const float> shares) const noexcept {
  Turns before, after;
  find_taught(from, change, before, after);
  const Vector3d back = back_of(frame, shares, before, after);
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
    const double share = share_of(part, shares);
    if (share == 0.0) continue;
    turn[j] = turn_of(part, pose[j], back, before, after);
    const Quaterniond own = carried.conjugate() * turn[j];
    if (share < 1.0) turn[j] = carried * rotation_exp(Vector3d(share * rotation_log(own)));
    const Quaterniond base = above < 0 ? seen : pose[p];
    const Quaterniond styled = (carried * base).conjugate() * turn[j] * pose[j];
    set_rotation(skeleton_, static_cast<int>(j), styled, frame);
  }
}

}  // namespace posed::style
