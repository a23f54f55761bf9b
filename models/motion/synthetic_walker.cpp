#include "models/motion/synthetic_walker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "models/motion/synthetic_gait.hpp"
#include "models/random.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::motion {
namespace {

constexpr double kFullTurn = 2.0 * std::numbers::pi;

enum JointName : int {
  kHips,
  kSpine,
  kChest,
  kNeck,
  kHead,
  kLeftShoulder,
  kLeftUpperArm,
  kLeftLowerArm,
  kLeftHand,
  kRightShoulder,
  kRightUpperArm,
  kRightLowerArm,
  kRightHand,
  kLeftUpperLeg,
  kLeftLowerLeg,
  kLeftFoot,
  kLeftToes,
  kRightUpperLeg,
  kRightLowerLeg,
  kRightFoot,
  kRightToes,
  kJointCount
};

// Where in a stride, and how much of the usual movement.
struct Beat {
  double phase = 0.0, swing = 1.0;
};

// A curve over a stride: mean + c1 cos + s1 sin + c2 cos 2 + s2 sin 2 of the phase, which is 0 when
// the right heel lands. The coefficients are means over nine walks of six people of the CMU motion
// capture database, each expressed in degrees or in lengths of the leg; the left side is half a
// stride later.
struct Curve {
  double mean, c1, s1, c2, s2;
  [[nodiscard]] double wave(Beat beat) const {
    const double phase = beat.phase;
    return beat.swing * (c1 * std::cos(phase) + s1 * std::sin(phase) + c2 * std::cos(2.0 * phase) +
                         s2 * std::sin(2.0 * phase));
  }
};
constexpr Curve kPelvisTurn_deg{0.0, 5.0, 1.0, 0.0, -0.1};
constexpr Curve kPelvisRoll_deg{0.0, 3.4, -3.4, 0.2, 1.0};
constexpr Curve kChestTurn_deg{0.0, -3.0, 0.3, -0.2, 0.1};
constexpr Curve kChestRoll_deg{0.0, 1.6, 1.0, 0.0, -0.2};
constexpr Curve kLean_deg{2.0, -0.3, 0.2, 0.5, -0.4};
constexpr Curve kHeadLean_deg{0.0, 0.6, 0.1, 0.0, -0.7};
constexpr Curve kPelvisUp{0.0, 0.0, 0.0, -0.015, -0.004};
constexpr Curve kPelvisLeft{0.0, 0.013, -0.020, 0.0, 0.003};
constexpr Curve kPelvisAhead{0.0, 0.001, -0.004, -0.005, 0.015};
constexpr Curve kArmAhead_deg{-3.0, -13.6, 1.3, 0.2, -0.9};  // of the right arm, as all below
constexpr Curve kArmOut_deg{5.0, -3.0, -0.6, 0.4, -0.5};
constexpr Curve kElbow_deg{30.0, -14.6, -3.1, 1.9, -0.2};

// What a family changes of an average walk: factors first, then what is added.
struct Manner {
  double cadence = 1, stride = 1, bounce = 1, sway = 1, roll = 1, turn = 1, chest = 1, swing = 1;
  double half_width_m = 0.045, lift_m = 0.012, crouch = 0;  // crouch: a share of the leg
  double lean_deg = 0, head_deg = 0, arm_ahead_deg = 0, arm_out_deg = 0, elbow_deg = 0,
         shoulder_deg = 0;
};

Manner manner_of(WalkerFamily family) {
  switch (family) {
    case WalkerFamily::kMarch:
      return {.bounce = 1.2,
              .turn = 0.7,
              .chest = 1.4,
              .swing = 2.4,
              .lift_m = 0.13,
              .lean_deg = -4,
              .head_deg = -2,
              .arm_ahead_deg = 4,
              .elbow_deg = -18};
    case WalkerFamily::kSway:
      return {.cadence = 0.9,
              .sway = 1.8,
              .roll = 2.4,
              .turn = 2.0,
              .chest = 2.2,
              .swing = 0.8,
              .half_width_m = 0.01,
              .lean_deg = -6,
              .head_deg = -3,
              .arm_out_deg = 16,
              .elbow_deg = 14};
    case WalkerFamily::kSneak:
      return {.cadence = 0.7,
              .stride = 0.75,
              .bounce = 0.8,
              .swing = 0.3,
              .half_width_m = 0.07,
              .lift_m = 0.12,
              .crouch = 0.16,
              .lean_deg = 26,
              .head_deg = -22,
              .arm_ahead_deg = 24,
              .arm_out_deg = 10,
              .elbow_deg = 72,
              .shoulder_deg = 8};
    case WalkerFamily::kTired:
      return {.cadence = 0.8,
              .stride = 0.62,
              .bounce = 0.6,
              .sway = 1.3,
              .roll = 0.8,
              .swing = 0.3,
              .half_width_m = 0.06,
              .lift_m = 0.03,
              .crouch = 0.04,
              .lean_deg = 17,
              .head_deg = 20,
              .arm_ahead_deg = -6,
              .elbow_deg = -14,
              .shoulder_deg = -9};
    case WalkerFamily::kWalk:
      break;
  }
  return {};
}

// What distinguishes this person in every family.
struct Person {
  bool woman = false;
  double height_m = 1.7, cadence = 1.0, vigour = 1.0, phase = 0.0;
  std::array<std::array<double, 3>, kLeftUpperLeg> carriage_deg{};  // of the joints above the legs
};

// Heights are those of adults of the USA (NHANES), cadences vary as in Perry, "Gait Analysis".
Person make_person(std::uint32_t seed) {
  PortableRandom random(seed * 2654435761U + 17U);
  Person person;
  person.woman = random.uniform(0.0, 1.0) < 0.5;
  person.height_m = person.woman ? random.uniform(1.53, 1.74) : random.uniform(1.65, 1.88);
  person.cadence = random.uniform(0.92, 1.08) * (person.woman ? 1.03 : 0.98);
  person.vigour = random.uniform(0.92, 1.08);
  person.phase = random.uniform(0.0, 1.0);
  for (int joint = kSpine; joint < kLeftUpperLeg; ++joint) {
    for (double& axis : person.carriage_deg[joint]) axis = random.uniform(-2.0, 2.0);
  }
  return person;
}

// Shares of the body's height after Drillis and Contini (1966), with the wider shoulders of men and
// the wider hips of women.
LegLengths make_leg(const Person& person) {
  const double h = person.height_m;
  return {.thigh_m = 0.245 * h,
          .shin_m = 0.246 * h,
          .ankle_m = 0.039 * h,
          .ball_m = 0.085 * h,
          .ball_height_m = 0.012 * h,
          .heel_m = 0.03 * h,
          .half_hips_m = (person.woman ? 0.053 : 0.049) * h,
          .hips_below_m = 0.03 * h};
}

class SkeletonMaker {
 public:
  explicit SkeletonMaker(double height_m) : height_m_(height_m) {}

  // Lengths are shares of the height.
  void add(const char* name, int parent, std::array<double, 3> offset,
           std::array<double, 3> end = {}) {
    Joint joint;
    joint.name = name;
    joint.parent = parent;
    joint.offset_m = height_m_ * Eigen::Vector3d(offset.data());
    const Eigen::Vector3d end_m = height_m_ * Eigen::Vector3d(end.data());
    if (!end_m.isZero()) joint.end_site_m = end_m;
    const auto index = static_cast<std::uint16_t>(skeleton_.joints.size());
    if (index == 0) {
      for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
        skeleton_.channels.push_back({.joint = index, .axis = axis, .translation = true});
      }
    }
    for (const Axis axis : {Axis::kZ, Axis::kX, Axis::kY}) {
      skeleton_.channels.push_back({.joint = index, .axis = axis, .translation = false});
    }
    skeleton_.joints.push_back(std::move(joint));
  }

  Result<Skeleton> finish() {
    skeleton_.name = "synthetic walker";
    TRY(skeleton_.finish());
    return std::move(skeleton_);
  }

 private:
  double height_m_;
  Skeleton skeleton_;
};

// A person in T-pose: Y up, facing +Z, left hand at +X.
Result<Skeleton> make_skeleton(const Person& person) {
  SkeletonMaker body(person.height_m);
  const double shoulder = person.woman ? 0.094 : 0.102, hip = person.woman ? 0.053 : 0.049;
  body.add("Hips", -1, {0, 0.56, 0});
  body.add("Spine", kHips, {0, 0.065, 0});
  body.add("Chest", kSpine, {0, 0.09, 0});
  body.add("Neck", kChest, {0, 0.135, 0});
  body.add("Head", kNeck, {0, 0.055, 0}, {0, 0.095, 0});
  for (const double x : kSideSign) {
    const bool left = x > 0.0;
    const int shoulder_joint = left ? kLeftShoulder : kRightShoulder;
    body.add(left ? "LeftShoulder" : "RightShoulder", kChest, {0.02 * x, 0.1, 0});
    body.add(left ? "LeftUpperArm" : "RightUpperArm", shoulder_joint, {shoulder * x, 0, 0});
    body.add(left ? "LeftLowerArm" : "RightLowerArm", shoulder_joint + 1, {0.172 * x, 0, 0});
    body.add(left ? "LeftHand" : "RightHand", shoulder_joint + 2, {0.152 * x, 0, 0},
             {0.1 * x, 0, 0});
  }
  for (const double x : kSideSign) {
    const bool left = x > 0.0;
    const int thigh = left ? kLeftUpperLeg : kRightUpperLeg;
    body.add(left ? "LeftUpperLeg" : "RightUpperLeg", kHips, {hip * x, -0.03, 0});
    body.add(left ? "LeftLowerLeg" : "RightLowerLeg", thigh, {0, -0.245, 0});
    body.add(left ? "LeftFoot" : "RightFoot", thigh + 1, {0, -0.246, 0});
    body.add(left ? "LeftToes" : "RightToes", thigh + 2, {0, -0.027, 0.085}, {0, -0.009, 0.037});
  }
  return body.finish();
}

Gait make_gait(const WalkerOptions& options, const Person& person, const Manner& manner) {
  const LegLengths leg = make_leg(person);
  // The walks that the curves come from: 1.75 leg lengths a stride, 1.09 s.
  Gait gait{.leg = leg,
            .stride_s = 1.09 / (person.cadence * manner.cadence),
            .stride_m = 1.72 * leg.length_m() * manner.stride * (0.5 + 0.5 * person.vigour),
            .half_width_m = manner.half_width_m,
            .lift_m = manner.lift_m * person.vigour};
  gait.push_rad *= std::min(1.0, 0.3 + 0.7 * manner.stride);
  gait.strike_rad *= manner.stride * manner.stride;
  if (options.round) {
    gait.stride_s = options.seconds / std::max(1.0, std::round(options.seconds / gait.stride_s));
  }
  return gait;
}

// Local rotations of one instant [joint], and where the root is.
struct Instant {
  std::array<Eigen::Quaterniond, kJointCount> turn;
  Eigen::Vector3d root_m = Eigen::Vector3d::Zero();
};

Eigen::Quaterniond euler_zxy(double z_deg, double x_deg, double y_deg) {
  return axis_rotation(Axis::kZ, kDegree * z_deg) * axis_rotation(Axis::kX, kDegree * x_deg) *
         axis_rotation(Axis::kY, kDegree * y_deg);
}

class Walker {
 public:
  explicit Walker(const WalkerOptions& options)
      : person_(make_person(options.person)),
        manner_(manner_of(options.family)),
        gait_(make_gait(options, person_, manner_)) {
    walking_height_m_ = walking_height_m() - manner_.crouch * gait_.leg.length_m();
    if (options.round) {
      gait_.round.emplace(gait_.stride_m, strides_in(options.seconds), kOver);
    }
  }

  [[nodiscard]] const Person& person() const { return person_; }
  [[nodiscard]] double strides_in(double seconds) const {
    return std::round(seconds / gait_.stride_s);
  }
  [[nodiscard]] Instant at(double time_s) const;

 private:
  [[nodiscard]] Beat beat(double stride) const {
    return {kFullTurn * stride, gait_.round ? gait_.round->swing(stride) : 1.0};
  }
  [[nodiscard]] double walking_height_m() const;
  [[nodiscard]] double height_m(double swing) const;
  [[nodiscard]] double into_turn_rad(double stride) const;
  [[nodiscard]] Eigen::Quaterniond pelvis(double stride) const;
  [[nodiscard]] Eigen::Vector3d root_m(double stride) const;  // but for the height
  void set_trunk(Beat beat, Instant& now) const;
  void look_into_turn(double stride, Instant& now) const;
  void set_arm(int side, Beat beat, Instant& now) const;

  Person person_;
  Manner manner_;
  Gait gait_;
  double walking_height_m_ = 0.0;  // of the root, without its bounce
};

Eigen::Quaterniond Walker::pelvis(double stride) const {
  const Beat p = beat(stride);
  return axis_rotation(Axis::kY, heading_rad(gait_, stride * gait_.stride_s)) *
         euler_zxy(manner_.roll * kPelvisRoll_deg.wave(p), 0.35 * manner_.lean_deg + 1.0,
                   manner_.turn * kPelvisTurn_deg.wave(p));
}

Eigen::Vector3d Walker::root_m(double stride) const {
  const Beat p = beat(stride);
  const double leg_m = gait_.leg.length_m();
  const double time_s = stride * gait_.stride_s;
  const Eigen::Vector3d beside(leg_m * (manner_.sway * kPelvisLeft.wave(p) + into_turn_rad(stride)),
                               leg_m * manner_.bounce * kPelvisUp.wave(p),
                               leg_m * kPelvisAhead.wave(p));
  return path_m(gait_, time_s) + axis_rotation(Axis::kY, heading_rad(gait_, time_s)) * beside;
}

// The greatest height at which both legs reach the floor all the time with knees a little bent, as
// he goes straight on.
double Walker::walking_height_m() const {
  constexpr int kInstants = 200;
  const double far_m = 0.995 * gait_.leg.length_m();
  double height_m = std::numeric_limits<double>::max();
  for (int i = 0; i < kInstants; ++i) {
    const double stride = static_cast<double>(i) / kInstants;
    for (int side = 0; side < 2; ++side) {
      const Eigen::Vector3d hip_m =
          root_m(stride) + pelvis(stride) * Eigen::Vector3d(kSideSign[side] * gait_.leg.half_hips_m,
                                                            -gait_.leg.hips_below_m, 0);
      const Eigen::Vector3d way_m = foot_at(gait_, side, stride).ankle_m - hip_m;
      const double beside_m = std::hypot(way_m.x(), way_m.z());
      const double up_m = std::sqrt(std::max(0.0, far_m * far_m - beside_m * beside_m));
      height_m = std::min(height_m, up_m + way_m.y());
    }
  }
  return height_m;
}

// Who stands straightens his legs.
double Walker::height_m(double swing) const {
  constexpr double kStraight = 0.995;
  const LegLengths& leg = gait_.leg;
  const double standing_m =
      leg.ankle_m + (kStraight - manner_.crouch) * leg.length_m() + leg.hips_below_m;
  return standing_m + swing * (walking_height_m_ - standing_m);
}

// How far the body leans into a turn, to the left: the centrifugal force over the weight.
double Walker::into_turn_rad(double stride) const {
  if (!gait_.round) return 0.0;
  constexpr double kGravity_m_s2 = 9.81;
  const double speed_m_s = gait_.round->pace(stride) * gait_.stride_m / gait_.stride_s;
  return gait_.round->turn_rad_per_stride(stride) / gait_.stride_s * speed_m_s / kGravity_m_s2;
}

// The head looks where the walk goes next, and the trunk leans there.
void Walker::look_into_turn(double stride, Instant& now) const {
  constexpr double kAhead = 0.6, kMaxLook_rad = 0.5;  // strides
  const double look_rad =
      std::clamp(gait_.round->heading_rad(stride + kAhead) - gait_.round->heading_rad(stride),
                 -kMaxLook_rad, kMaxLook_rad);
  const auto lean = axis_rotation(Axis::kZ, -0.35 * into_turn_rad(stride));
  for (const int joint : {kSpine, kChest}) now.turn[joint] = lean * now.turn[joint];
  const auto look = axis_rotation(Axis::kY, 0.4 * look_rad);
  for (const int joint : {kNeck, kHead}) now.turn[joint] = look * now.turn[joint];
}

// Pelvis and chest are turned against the walk's direction; the spine shares the way between them,
// and the head looks ahead.
void Walker::set_trunk(Beat beat, Instant& now) const {
  const auto half = [](double chest, double pelvis) { return 0.5 * (chest - pelvis); };
  const double roll =
      half(manner_.chest * kChestRoll_deg.wave(beat), manner_.roll * kPelvisRoll_deg.wave(beat));
  const double turn =
      half(manner_.chest * kChestTurn_deg.wave(beat), manner_.turn * kPelvisTurn_deg.wave(beat));
  const double lean = 0.5 * (kLean_deg.mean + kLean_deg.wave(beat)) + 0.325 * manner_.lean_deg;
  now.turn[kSpine] = euler_zxy(roll, lean, turn);
  now.turn[kChest] = euler_zxy(roll, lean, turn);
  const double head = manner_.head_deg + kHeadLean_deg.wave(beat) - 1.5 * lean * 0.5;
  const double chest_turn = manner_.chest * kChestTurn_deg.wave(beat);
  now.turn[kNeck] = euler_zxy(0.0, 0.5 * head, -0.4 * chest_turn);
  now.turn[kHead] =
      euler_zxy(-0.5 * manner_.chest * kChestRoll_deg.wave(beat), 0.5 * head, -0.4 * chest_turn);
}

void Walker::set_arm(int side, Beat beat, Instant& now) const {
  const double sign = kSideSign[side];
  const Beat own{beat.phase + (side == 0 ? std::numbers::pi : 0.0), beat.swing};
  const double swing = manner_.swing * person_.vigour;
  // In T-pose an arm points to its side: turned about Y it swings, then Z lets it hang.
  const double ahead = kArmAhead_deg.mean + manner_.arm_ahead_deg + swing * kArmAhead_deg.wave(own);
  const double out = kArmOut_deg.mean + manner_.arm_out_deg + kArmOut_deg.wave(own);
  constexpr double kHangs_deg = 12.0;  // an arm that does not swing is straighter
  const double elbow =
      std::max(4.0, kElbow_deg.mean - (1.0 - beat.swing) * kHangs_deg + manner_.elbow_deg +
                        std::min(1.2, swing) * kElbow_deg.wave(own));
  const int shoulder = side == 0 ? kLeftShoulder : kRightShoulder;
  now.turn[shoulder] = euler_zxy(sign * 0.5 * manner_.shoulder_deg, 0.0, 0.0);
  now.turn[shoulder + 1] =
      euler_zxy(sign * (out - 90.0 - 0.5 * manner_.shoulder_deg), 0.0, -sign * ahead);
  now.turn[shoulder + 2] = euler_zxy(0.0, 0.0, -sign * elbow);
  now.turn[shoulder + 3] = euler_zxy(-sign * 4.0, 0.0, -sign * 6.0);
}

Instant Walker::at(double time_s) const {
  const double stride = person_.phase + time_s / gait_.stride_s;
  Instant now;
  now.turn[kHips] = pelvis(stride);
  now.root_m = root_m(stride) + Eigen::Vector3d(0, height_m(beat(stride).swing), 0);
  set_trunk(beat(stride), now);
  if (gait_.round) look_into_turn(stride, now);
  for (int side = 0; side < 2; ++side) {
    set_arm(side, beat(stride), now);
    const LegPose leg =
        reach(gait_.leg, side, now.root_m, now.turn[kHips], foot_at(gait_, side, stride));
    const int thigh = side == 0 ? kLeftUpperLeg : kRightUpperLeg;
    now.turn[thigh] = leg.thigh;
    now.turn[thigh + 1] = leg.shin;
    now.turn[thigh + 2] = leg.foot;
    now.turn[thigh + 3] = leg.toes;
  }
  for (int joint = kSpine; joint < kLeftUpperLeg; ++joint) {
    const auto& [x, y, z] = person_.carriage_deg[joint];
    now.turn[joint] = now.turn[joint] * euler_zxy(z, x, y);
  }
  return now;
}

}  // namespace

Result<clip::Clip> make_walker(const WalkerOptions& options) {
  if (!(options.seconds > 0.0 && options.rate_hz > 0.0)) {
    return fail("a walk has a length and a rate above 0");
  }
  const Walker walker(options);
  if (options.round && walker.strides_in(options.seconds) < Round::kMinStrides) {
    return fail("a walker's round takes at least 12 strides, about 16 s");
  }
  clip::Clip walk;
  walk.path = "synthetic";
  auto skeleton = TRY(make_skeleton(walker.person()));
  walk.skeleton = std::make_shared<const Skeleton>(std::move(skeleton));
  walk.frame_rate_hz = options.rate_hz;
  const auto frames = static_cast<Eigen::Index>(std::lround(options.seconds * options.rate_hz));
  walk.channels.resize(frames, static_cast<Eigen::Index>(walk.skeleton->channels.size()));
  PortableRandom random(options.person * 977U + static_cast<std::uint32_t>(options.family) + 5U);
  std::array<std::array<double, 3>, kJointCount> near_rad{};
  for (Eigen::Index t = 0; t < frames; ++t) {
    const Instant now = walker.at(static_cast<double>(t) / options.rate_hz);
    auto row = walk.channels.row(t);
    row.head<3>() = now.root_m.transpose();
    for (int joint = 0; joint < kJointCount; ++joint) {
      near_rad[joint] =
          channels_from_rotation(*walk.skeleton, joint, now.turn[joint], near_rad[joint]);
      for (int axis = 0; axis < 3; ++axis) {
        const bool trembles = joint > kHips && joint < kLeftUpperLeg;
        const double noise_deg = trembles ? options.noise_deg * random.normal() : 0.0;
        row[3 + 3 * joint + axis] = near_rad[joint][axis] + kDegree * noise_deg;
      }
    }
  }
  return walk;
}

}  // namespace posed::motion
