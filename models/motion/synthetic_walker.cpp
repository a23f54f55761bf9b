#include "models/motion/synthetic_walker.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "models/random.hpp"
#include "proto/frame/degree.hpp"

namespace posed::motion {
namespace {

struct JointSpec {
  const char* name;
  const char* parent;  // empty for the root
  std::array<double, 3> offset_m;
  std::array<double, 3> end_site_m;  // all zero: the joint has a child
};

// A person of 1.72 m in T-pose: Y up, facing +Z, left hand at +X.
constexpr std::array<JointSpec, 19> kJoints{{
    {"Hips", "", {0, 0.94, 0}, {}},
    {"Spine", "Hips", {0, 0.12, 0}, {}},
    {"Chest", "Spine", {0, 0.16, 0}, {}},
    {"Neck", "Chest", {0, 0.24, 0}, {}},
    {"Head", "Neck", {0, 0.09, 0}, {0, 0.17, 0}},
    {"LeftShoulder", "Chest", {0.04, 0.18, 0}, {}},
    {"LeftUpperArm", "LeftShoulder", {0.13, 0, 0}, {}},
    {"LeftLowerArm", "LeftUpperArm", {0.28, 0, 0}, {}},
    {"LeftHand", "LeftLowerArm", {0.25, 0, 0}, {0.09, 0, 0}},
    {"RightShoulder", "Chest", {-0.04, 0.18, 0}, {}},
    {"RightUpperArm", "RightShoulder", {-0.13, 0, 0}, {}},
    {"RightLowerArm", "RightUpperArm", {-0.28, 0, 0}, {}},
    {"RightHand", "RightLowerArm", {-0.25, 0, 0}, {-0.09, 0, 0}},
    {"LeftUpperLeg", "Hips", {0.09, -0.05, 0}, {}},
    {"LeftLowerLeg", "LeftUpperLeg", {0, -0.42, 0}, {}},
    {"LeftFoot", "LeftLowerLeg", {0, -0.41, 0}, {0, -0.05, 0.14}},
    {"RightUpperLeg", "Hips", {-0.09, -0.05, 0}, {}},
    {"RightLowerLeg", "RightUpperLeg", {0, -0.42, 0}, {}},
    {"RightFoot", "RightLowerLeg", {0, -0.41, 0}, {0, -0.05, 0.14}},
}};

// One rotation channel over the phase: mean + c1 cos(th - p1) + c2 cos(2 th - p2), degrees.
struct Wave {
  double mean = 0.0, first = 0.0, first_phase = 0.0, second = 0.0, second_phase = 0.0;
  [[nodiscard]] double at(double theta) const {
    return mean + first * std::cos(theta - first_phase) +
           second * std::cos(2.0 * theta - second_phase);
  }
};
using JointWaves = std::array<Wave, 3>;  // about X, Y, Z

// Amplitudes and offsets of a family about X (pitch), Y (turn), Z (roll). `march` and `sway` share
// one table so that the difference between them is easy to see: the second value of each pair is
// that of the swaying walk.
struct FamilyAmounts {
  double arm_swing, arm_out, elbow, thigh_swing, thigh_in, knee, hip_roll, hip_turn, chest_turn,
      lean;
};
constexpr FamilyAmounts kMarch{34, 12, 18, 27, 3, 30, 2, 4, 9, 4};
constexpr FamilyAmounts kSway{16, 24, 34, 23, -5, 25, 8, 9, 4, -2};

void set_legs(std::vector<JointWaves>& joint, const FamilyAmounts& f) {
  constexpr double pi = std::numbers::pi;
  for (int side = 0; side < 2; ++side) {
    const double phase = side == 0 ? pi : 0.0;  // the right thigh is forward at phase 0
    const double sign = side == 0 ? 1.0 : -1.0;
    const std::size_t thigh = side == 0 ? 13 : 16;
    joint[thigh][0] = {-4.0, -f.thigh_swing, phase, 4.0, 0.6};
    joint[thigh][2] = {sign * f.thigh_in, 1.5, phase, 0.0, 0.0};
    joint[thigh + 1][0] = {f.knee * 0.75, f.knee * 0.6, phase + 1.9, f.knee * 0.45,
                           2.0 * phase + 2.6};
    joint[thigh + 2][0] = {-2.0, 9.0, phase + 0.8, 6.0, 1.1};
  }
}

void set_arms(std::vector<JointWaves>& joint, const FamilyAmounts& f) {
  constexpr double pi = std::numbers::pi;
  for (int side = 0; side < 2; ++side) {
    const double phase = side == 0 ? 0.0 : pi;  // each arm swings with the other side's leg
    const double sign = side == 0 ? 1.0 : -1.0;
    const std::size_t upper = side == 0 ? 6 : 10;
    joint[upper][2] = {sign * (f.arm_out - 82.0), 2.0, phase, 0.0, 0.0};  // hanging beside the body
    joint[upper][1] = {0.0, sign * -f.arm_swing, phase, 0.0, 0.0};
    joint[upper + 1][1] = {sign * -f.elbow, sign * -f.elbow * 0.35, phase, 0.0, 0.0};
    joint[upper + 2][2] = {0.0, sign * f.arm_swing * 0.15, phase + 0.4, 0.0, 0.0};
  }
}

std::vector<JointWaves> family_waves(WalkerFamily family) {
  const FamilyAmounts& f = family == WalkerFamily::kMarch ? kMarch : kSway;
  std::vector<JointWaves> joint(kJoints.size());
  set_legs(joint, f);
  set_arms(joint, f);
  joint[0] = {Wave{f.lean * 0.5, 0, 0, 1.5, 0.4}, Wave{0, f.hip_turn, 0, 0, 0},
              Wave{0, f.hip_roll, -1.4, 0, 0}};
  joint[1] = {Wave{f.lean * 0.5, 0, 0, 1.0, 0}, Wave{0, -f.chest_turn * 0.6, 0, 0, 0},
              Wave{0, -f.hip_roll * 0.7, -1.4, 0, 0}};
  joint[2] = {Wave{f.lean * 0.3, 0, 0, 0.8, 0.5}, Wave{0, -f.chest_turn, 0, 0, 0},
              Wave{0, -f.hip_roll * 0.4, -1.4, 0, 0}};
  joint[4] = {Wave{-f.lean, 0, 0, 1.0, 2.0}, Wave{0, f.chest_turn * 0.4, 0, 0, 0}, Wave{}};
  return joint;
}

// What distinguishes this person in either family: posture, vigour, cadence, size.
struct Person {
  std::vector<std::array<double, 3>> carriage_deg;
  double vigour = 1.0, cadence_hz = 0.95, scale = 1.0, phase = 0.0;
};

Person make_person(std::uint32_t seed) {
  PortableRandom random(seed * 2654435761U + 17U);
  Person person;
  person.vigour = random.uniform(0.92, 1.08);
  person.cadence_hz = random.uniform(0.85, 1.05);
  person.scale = random.uniform(0.94, 1.06);
  person.phase = random.uniform(0.0, 2.0 * std::numbers::pi);
  person.carriage_deg.resize(kJoints.size());
  for (auto& joint : person.carriage_deg) {
    for (double& axis : joint) axis = random.uniform(-2.0, 2.0);
  }
  return person;
}

Result<Skeleton> make_skeleton(double scale) {
  Skeleton skeleton;
  skeleton.name = "synthetic walker";
  for (const JointSpec& spec : kJoints) {
    Joint joint;
    joint.name = spec.name;
    joint.parent = skeleton.joint_index(spec.parent);
    joint.offset_m = scale * Eigen::Vector3d(spec.offset_m.data());
    const Eigen::Vector3d end(spec.end_site_m.data());
    if (!end.isZero()) joint.end_site_m = scale * end;
    const auto index = static_cast<std::uint16_t>(skeleton.joints.size());
    if (index == 0) {
      for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
        skeleton.channels.push_back({.joint = index, .axis = axis, .translation = true});
      }
    }
    for (const Axis axis : {Axis::kZ, Axis::kX, Axis::kY}) {
      skeleton.channels.push_back({.joint = index, .axis = axis, .translation = false});
    }
    skeleton.joints.push_back(std::move(joint));
  }
  TRY(skeleton.finish());
  return skeleton;
}

}  // namespace

Result<clip::Clip> make_walker(const WalkerOptions& options) {
  const Person person = make_person(options.person);
  const std::vector<JointWaves> waves = family_waves(options.family);
  clip::Clip walk;
  walk.path = "synthetic";
  auto skeleton = TRY(make_skeleton(person.scale));
  walk.skeleton = std::make_shared<const Skeleton>(std::move(skeleton));
  walk.frame_rate_hz = options.rate_hz;
  const auto frames = static_cast<Eigen::Index>(std::lround(options.seconds * options.rate_hz));
  walk.channels.resize(frames, static_cast<Eigen::Index>(walk.skeleton->channels.size()));
  PortableRandom random(options.person * 977U + static_cast<std::uint32_t>(options.family) + 5U);
  const double speed_m_s = 1.35 * person.scale * person.vigour;
  for (Eigen::Index t = 0; t < frames; ++t) {
    const double time_s = static_cast<double>(t) / options.rate_hz;
    const double theta = person.phase + 2.0 * std::numbers::pi * person.cadence_hz * time_s;
    for (std::size_t c = 0; c < walk.skeleton->channels.size(); ++c) {
      const Channel& channel = walk.skeleton->channels[c];
      const auto axis = static_cast<std::size_t>(channel.axis);
      double& value = walk.channels(t, static_cast<Eigen::Index>(c));
      if (channel.translation) {
        const std::array<double, 3> root{0.02 * std::cos(theta),
                                         person.scale * 0.94 + 0.02 * std::cos(2.0 * theta),
                                         speed_m_s * time_s};
        value = root[axis];
      } else {
        const double turn = person.vigour * waves[channel.joint][axis].at(theta) +
                            person.carriage_deg[channel.joint][axis];
        value = kDegree * (turn + options.noise_deg * random.normal());
      }
    }
  }
  return walk;
}

}  // namespace posed::motion
