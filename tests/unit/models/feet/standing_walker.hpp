// A synthetic walker whose feet stand on the ground or on stairs, and the same walk in a style:
// smaller steps and bent knees.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "models/feet/feet_stage.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/last_frame.hpp"

namespace posed::test {

struct StyledWalk {
  motion::Motion source, styled;
};

inline Eigen::Vector3d root_of(const Frame& frame) {
  return Eigen::Vector3f(frame.root_position_m.data()).cast<double>();
}

inline void set_root(Frame& frame, const Eigen::Vector3d& root_m) {
  for (int i = 0; i < 3; ++i) {
    frame.root_position_m[static_cast<std::size_t>(i)] = static_cast<float>(root_m[i]);
  }
}

// Turns a leg so that its ankle is at `ankle_m` from the hip in the sagittal plane (y up, z ahead)
// and its foot level.
inline void set_leg(const Skeleton& skeleton, const feet::Leg& leg, double y_m, double z_m,
                    Frame& frame) {
  const double a = leg.thigh_m, b = leg.shin_m;
  const double far_m = std::min(std::hypot(y_m, z_m), 0.999 * (a + b));
  const double knee = std::acos((far_m * far_m - a * a - b * b) / (2.0 * a * b));
  const double ahead =
      std::atan2(z_m, -y_m) + std::atan2(b * std::sin(knee), a + b * std::cos(knee));
  const auto turn = [&](int joint, double angle_rad) {
    set_rotation(skeleton, joint, axis_rotation(Axis::kX, angle_rad), frame);
  };
  turn(leg.thigh, -ahead);
  turn(leg.shin, knee);
  turn(leg.foot, ahead - knee);
}

// Steps of half a metre, one a second and leg, each `rise_m` higher than the one before.
inline void walk_on(motion::Motion& motion, double rise_m) {
  constexpr double kStance = 0.6, kStep_m = 0.5, kHip_m = 0.70, kLift_m = 0.08;
  const Skeleton& skeleton = *motion.skeleton;
  const feet::Legs legs = feet::Legs::find(skeleton).value();
  const double stride_m = kStep_m / kStance;
  for (std::size_t t = 0; t < motion.frames.size(); ++t) {
    Frame& frame = motion.frames[t];
    const double strides = static_cast<double>(t) / motion.rate_hz;
    const Eigen::Vector3d hip_m(0.0, kHip_m + 2.0 * rise_m * (strides - 0.3), stride_m * strides);
    for (std::size_t i = 0; i < feet::kLegs; ++i) {
      const double shift = i == 0 ? 0.0 : 0.5;
      const double step = std::floor(strides + shift);
      const double swing = std::max(0.0, (strides + shift - step - kStance) / (1.0 - kStance));
      const double way = step - shift + swing * swing * (3.0 - 2.0 * swing);
      const double lift_m = kLift_m * std::pow(std::sin(swing * std::numbers::pi), 2.0);
      set_leg(skeleton, legs.leg(i), 2.0 * rise_m * way + lift_m - hip_m.y(),
              stride_m * (way + 0.3) - hip_m.z(), frame);
    }
    set_root(frame, hip_m + Eigen::Vector3d(0.0, 0.1, 0.0));
  }
}

// The rotation of a joint, a share of it.
inline void turn_share(const Skeleton& skeleton, Bone bone, double share, Frame& frame) {
  const int joint = skeleton.joint_of(bone);
  const auto local = to_eigen_double(frame.rotation_xyzw[static_cast<std::size_t>(joint)]);
  const Eigen::Vector3d turn = share * rotation_log(local);
  set_rotation(skeleton, joint, rotation_exp(turn), frame);
}

// `style`: 0 leaves the walk alone, 1 makes its steps a third smaller.
inline void restyle(const Skeleton& skeleton, double style, Frame& frame) {
  for (const Bone bone : {Bone::kLeftUpperLeg, Bone::kRightUpperLeg}) {
    turn_share(skeleton, bone, 1.0 - style / 3.0, frame);
  }
  for (const Bone bone : {Bone::kLeftLowerLeg, Bone::kRightLowerLeg}) {
    turn_share(skeleton, bone, 1.0 + style / 4.0, frame);
  }
}

inline StyledWalk styled_walk(double rate_hz, double seconds, double rise_m = 0.0) {
  const auto clip = motion::make_walker({.seconds = seconds, .rate_hz = rate_hz}).value();
  StyledWalk walk{.source = motion::motion_of(clip).value(), .styled = {}};
  // The legs hang from hips that neither roll nor turn.
  const auto hips = walk.source.skeleton->joint_of(Bone::kHips);
  for (Frame& frame : walk.source.frames) {
    set_rotation(*walk.source.skeleton, hips, Eigen::Quaterniond::Identity(), frame);
  }
  walk_on(walk.source, rise_m);
  walk.styled = walk.source;
  for (Frame& frame : walk.styled.frames) restyle(*walk.source.skeleton, 1.0, frame);
  return walk;
}

inline std::unique_ptr<Stage> feet_stage(const motion::Motion& motion, const std::string& root) {
  const auto parameters = complete_parameters(feet::feet_type().parameters, {{"root", root}});
  return feet::feet_type()
      .make({.skeleton = motion.skeleton, .rate_hz = motion.rate_hz, .parameters = *parameters},
            nullptr)
      .value();
}

inline Frame through(Stage& stage, const Frame& source, const Frame& styled) {
  LastFrame last;
  stage.process({.frame = styled, .input = &source}, last);
  return last.out;
}

// The styled walk behind the stage.
inline motion::Motion through(Stage& stage, const StyledWalk& walk) {
  motion::Motion out = walk.styled;
  for (std::size_t t = 0; t < out.frames.size(); ++t) {
    out.frames[t] = through(stage, walk.source.frames[t], walk.styled.frames[t]);
  }
  return out;
}

inline double root_apart_m(const Frame& a, const Frame& b) {
  return (root_of(a) - root_of(b)).norm();
}

inline bool same_pose(const Frame& a, const Frame& b) {
  return a.root_position_m == b.root_position_m && a.rotation_xyzw == b.rotation_xyzw &&
         a.angle_rad == b.angle_rad;
}

}  // namespace posed::test
