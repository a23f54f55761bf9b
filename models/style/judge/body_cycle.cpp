#include "models/style/judge/body_cycle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "models/feet/legs.hpp"
#include "models/motion/kinematics.hpp"
#include "models/style/model/harmonics.hpp"
#include "proto/frame/median.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

using BoneEnds = std::pair<Bone, Bone>;

// A limb's bone ends at the next one. The chest is the highest of two.
constexpr std::ptrdiff_t kArmBones = 4;  // the first ones
constexpr std::array<BoneEnds, 13> kBones{{{Bone::kLeftUpperArm, Bone::kLeftLowerArm},
                                           {Bone::kLeftLowerArm, Bone::kLeftHand},
                                           {Bone::kRightUpperArm, Bone::kRightLowerArm},
                                           {Bone::kRightLowerArm, Bone::kRightHand},
                                           {Bone::kLeftUpperLeg, Bone::kLeftLowerLeg},
                                           {Bone::kLeftLowerLeg, Bone::kLeftFoot},
                                           {Bone::kRightUpperLeg, Bone::kRightLowerLeg},
                                           {Bone::kRightLowerLeg, Bone::kRightFoot},
                                           {Bone::kRightUpperLeg, Bone::kLeftUpperLeg},
                                           {Bone::kRightUpperArm, Bone::kLeftUpperArm},
                                           {Bone::kHips, Bone::kChest},
                                           {Bone::kChest, Bone::kNeck},
                                           {Bone::kNeck, Bone::kHead}}};

int joint_of(const Skeleton& skeleton, Bone bone) {
  const int upper = bone == Bone::kChest ? skeleton.joint_of(Bone::kUpperChest) : -1;
  return upper >= 0 ? upper : skeleton.joint_of(bone);
}

constexpr double kShortest_m = 1e-3;  // of a bone that has a direction

// The ground is where the lower foot is in its lowest twentieth of the time.
constexpr double kGroundShare = 0.05;

MatrixXd mean_cycle(const WalkPhases& walk, const MatrixXd& values) {
  const MatrixXd kept = values(walk.frames, Eigen::all);
  return grid_basis() * fit_harmonics(walk.phase, kept, kCycleHarmonics);
}

double rms_of(const MatrixXd& values) {
  return std::sqrt(values.squaredNorm() /
                   static_cast<double>(std::max<Eigen::Index>(1, values.size())));
}

double ground_m(VectorXd feet_m) { return quantile(feet_m, kGroundShare); }

// The frames from a share of the walk to another.
std::optional<WalkPhases> part_of(const WalkPhases& walk, double from, double to) {
  const auto size = static_cast<double>(walk.frames.size());
  const auto first = static_cast<std::size_t>(from * size);
  const auto count = static_cast<std::size_t>(to * size) - first;
  if (count < 2) return std::nullopt;
  const auto begin = static_cast<Eigen::Index>(first);
  const VectorXd phase = walk.phase.segment(begin, static_cast<Eigen::Index>(count));
  if (phase[phase.size() - 1] - phase[0] < 2.0 * std::numbers::pi) return std::nullopt;
  return WalkPhases{.frames = {walk.frames.begin() + static_cast<std::ptrdiff_t>(first),
                               walk.frames.begin() + static_cast<std::ptrdiff_t>(first + count)},
                    .phase = phase};
}

}  // namespace

std::optional<WalkPhases> walk_phases(const motion::Motion& motion) {
  const auto leg = motion::leg_signal(motion);
  return leg ? walk_phases(*leg, motion.rate_hz) : std::nullopt;
}

std::optional<BodyCycle> body_cycle(const motion::Motion& motion, const WalkPhases& walk) {
  const Skeleton& skeleton = *motion.skeleton;
  const auto legs = feet::Legs::find(skeleton);
  const int hips = skeleton.joint_of(Bone::kHips);
  const std::array ankles{skeleton.joint_of(Bone::kLeftFoot), skeleton.joint_of(Bone::kRightFoot)};
  if (!legs || hips < 0 || ankles[0] < 0 || ankles[1] < 0) return std::nullopt;
  BodyCycle cycle;
  std::vector<std::pair<int, int>> ends;
  const auto first = motion::world_pose(skeleton, motion.frames.front());
  for (const BoneEnds& bone : kBones) {
    const std::pair joints{joint_of(skeleton, bone.first), joint_of(skeleton, bone.second)};
    if (joints.first < 0 || joints.second < 0) continue;
    // Some files have the neck in the chest, from where it points nowhere.
    const Vector3d along = first.position_m[static_cast<std::size_t>(joints.second)] -
                           first.position_m[static_cast<std::size_t>(joints.first)];
    if (!(along.norm() > kShortest_m)) continue;
    cycle.bones.push_back(bone);
    ends.push_back(joints);
  }
  const int head = skeleton.joint_of(Bone::kHead);
  MatrixXd hips_m(motion.size(), 3);
  MatrixXd trunk_m = MatrixXd::Zero(motion.size(), 3);
  MatrixXd direction(motion.size(), 3 * std::ssize(ends));
  VectorXd feet_m(motion.size());
  const Eigen::AngleAxisd seen(-motion::walk_heading_rad(motion), Vector3d::UnitY());
  for (int i = 0; i < motion.size(); ++i) {
    const auto pose = motion::world_pose(skeleton, motion.frames[static_cast<std::size_t>(i)]);
    const auto at = [&](int j) { return pose.position_m[static_cast<std::size_t>(j)]; };
    hips_m.row(i) = (seen * at(hips)).transpose();
    if (head >= 0) trunk_m.row(i) = (seen * (at(head) - at(hips))).transpose();
    feet_m[i] = std::min(at(ankles[0]).y(), at(ankles[1]).y());
    for (std::size_t b = 0; b < ends.size(); ++b) {
      const Vector3d along = seen * (at(ends[b].second) - at(ends[b].first));
      direction.block<1, 3>(i, 3 * static_cast<Eigen::Index>(b)) = along.normalized().transpose();
    }
  }
  const double leg_m = legs->length_m();
  cycle.height = mean_cycle(walk, (hips_m.col(1).array() - ground_m(feet_m)).matrix() / leg_m);
  cycle.speed_s = mean_cycle(walk, motion::time_derivative(hips_m, motion.rate_hz).col(2) / leg_m);
  const Eigen::RowVector3d trunk = trunk_m(walk.frames, Eigen::all).colwise().mean();
  cycle.lean_rad = std::atan2(trunk.z(), trunk.y());
  cycle.cadence_rad_s = (walk.phase[walk.phase.size() - 1] - walk.phase[0]) * motion.rate_hz /
                        static_cast<double>(walk.frames.back() - walk.frames.front());
  cycle.direction = mean_cycle(walk, direction);
  for (Eigen::Index i = 0; i < cycle.direction.rows(); ++i) {
    for (Eigen::Index d = 0; d < cycle.direction.cols(); d += 3) {
      cycle.direction.block<1, 3>(i, d).normalize();
    }
  }
  return cycle;
}

BodyError apart(const BodyCycle& a, const BodyCycle& b) {
  BodyError error{.height = rms_of(a.height - b.height),
                  .speed_s = rms_of(a.speed_s - b.speed_s),
                  .tempo = std::abs(a.cadence_rad_s / b.cadence_rad_s - 1.0)};
  double sum = 0.0;
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < a.bones.size(); ++i) {
    const auto other = std::ranges::find(b.bones, a.bones[i]);
    if (other == b.bones.end()) continue;
    const Eigen::Index in_a = 3 * static_cast<Eigen::Index>(i);
    const Eigen::Index in_b = 3 * (other - b.bones.begin());
    for (Eigen::Index t = 0; t < a.direction.rows(); ++t) {
      const Vector3d one = a.direction.block<1, 3>(t, in_a).transpose();
      const Vector3d two = b.direction.block<1, 3>(t, in_b).transpose();
      const double turn_rad = std::atan2(one.cross(two).norm(), one.dot(two));
      sum += turn_rad * turn_rad;
      ++count;
    }
  }
  error.direction_rad = count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
  return error;
}

std::optional<BodyErrors> body_errors(const motion::Motion& source, const motion::Motion& styled,
                                      const motion::Motion& target) {
  const auto walk = walk_phases(source);
  const auto styled_walk = walk_phases(styled);
  const auto goal_walk = walk_phases(target);
  const auto legs = feet::Legs::find(*source.skeleton);
  if (!walk || !styled_walk || !goal_walk || !legs) return std::nullopt;
  const auto before = body_cycle(source, *walk);
  const auto after = body_cycle(styled, *styled_walk);
  const auto goal = body_cycle(target, *goal_walk);
  if (!before || !after || !goal) return std::nullopt;
  BodyErrors errors{.source = apart(*before, *goal),
                    .styled = apart(*after, *goal),
                    .floor = {},
                    .leg_m = legs->length_m()};
  const auto begin = part_of(*goal_walk, 0.0, 0.5);
  const auto end = part_of(*goal_walk, 0.5, 1.0);
  if (begin && end) errors.floor = apart(*body_cycle(target, *begin), *body_cycle(target, *end));
  return errors;
}

namespace {

// The directions of some bones, which the cycle has [28 x 3 a bone].
MatrixXd directions(const BodyCycle& cycle, const std::vector<BoneEnds>& bones) {
  MatrixXd found(cycle.direction.rows(), 3 * std::ssize(bones));
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const auto at = std::ranges::find(cycle.bones, bones[b]) - cycle.bones.begin();
    found.middleCols<3>(3 * static_cast<Eigen::Index>(b)) =
        cycle.direction.middleCols<3>(3 * static_cast<Eigen::Index>(at));
  }
  return found;
}

double norm_per_phase(const MatrixXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.rows()));
}

// Rms over the arms' bones, which stand first, and of the worst one. A difference of unit vectors
// is the angle, where that is small.
std::pair<double, double> arms_off_rad(const MatrixXd& off, const std::vector<BoneEnds>& bones) {
  double sum = 0.0;
  double worst = 0.0;
  Eigen::Index arms = 0;
  for (const BoneEnds& bone : bones) {
    if (std::ranges::find(kBones, bone) - kBones.begin() >= kArmBones) break;
    const double one = norm_per_phase(off.middleCols<3>(3 * arms));
    sum += one * one;
    worst = std::max(worst, one);
    ++arms;
  }
  return {arms > 0 ? std::sqrt(sum / static_cast<double>(arms)) : 0.0, worst};
}

// What the halves of two clips teach differs by, over what they teach.
std::optional<double> floor_of(const motion::Motion& source, const WalkPhases& from,
                               const motion::Motion& target, const WalkPhases& to,
                               const std::vector<BoneEnds>& bones, double taught) {
  std::array<MatrixXd, 2> halves;
  for (const int half : {0, 1}) {
    const auto one = part_of(from, 0.5 * half, 0.5 + 0.5 * half);
    const auto other = part_of(to, 0.5 * half, 0.5 + 0.5 * half);
    if (!one || !other) return std::nullopt;
    halves.at(static_cast<std::size_t>(half)) = directions(*body_cycle(target, *other), bones) -
                                                directions(*body_cycle(source, *one), bones);
  }
  return (halves[1] - halves[0]).norm() / taught;
}

}  // namespace

std::optional<Arrival> arrival(const motion::Motion& before, const motion::Motion& after,
                               const motion::Motion& source, const motion::Motion& target) {
  const auto walk = walk_phases(before);
  const auto from = walk_phases(source);
  const auto to = walk_phases(target);
  if (!walk || !from || !to) return std::nullopt;
  const auto own = body_cycle(before, *walk);
  const auto got = body_cycle(after, *walk);
  const auto plain = body_cycle(source, *from);
  const auto goal = body_cycle(target, *to);
  if (!own || !got || !plain || !goal) return std::nullopt;
  std::vector<BoneEnds> bones;
  for (const BoneEnds& bone : own->bones) {
    const auto has = [&](const BodyCycle& cycle) {
      return std::ranges::find(cycle.bones, bone) != cycle.bones.end();
    };
    if (has(*plain) && has(*goal)) bones.push_back(bone);
  }
  const MatrixXd taught = directions(*goal, bones) - directions(*plain, bones);
  const MatrixXd off = directions(*got, bones) - directions(*own, bones) - taught;
  if (!(taught.norm() > 0.0)) return std::nullopt;
  const double taught_lean_rad = goal->lean_rad - plain->lean_rad;
  const auto [arms_rad, worst_rad] = arms_off_rad(off, bones);
  return Arrival{.missing = off.norm() / taught.norm(),
                 .arms_rad = arms_rad,
                 .worst_arm_rad = worst_rad,
                 .lean_rad = got->lean_rad - own->lean_rad - taught_lean_rad,
                 .unstyled_arms_rad = arms_off_rad(taught, bones).first,
                 .unstyled_lean_rad = -taught_lean_rad,
                 .floor = floor_of(source, *from, target, *to, bones, taught.norm())};
}

}  // namespace posed::style
