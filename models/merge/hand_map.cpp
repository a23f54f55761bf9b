#include "models/merge/hand_map.hpp"

#include <algorithm>
#include <array>
#include <numbers>

#include "models/merge/merged_skeleton.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::merge {
namespace {

using Eigen::Quaterniond;

constexpr double kRadian = std::numbers::pi / 180.0;
// Flexion of a hand at rest, from the palm outwards.
constexpr std::array<double, kFingerJoints> kThumbAtRest_rad{5 * kRadian, 10 * kRadian,
                                                             15 * kRadian};
constexpr std::array<double, kFingerJoints> kFingerAtRest_rad{20 * kRadian, 30 * kRadian,
                                                              15 * kRadian};

const Joint& joint_at(const Skeleton& skeleton, int joint) { return skeleton.joints[joint]; }

bool has_rotations(const Skeleton& skeleton, int joint) {
  return std::ranges::any_of(skeleton.channels, [joint](const Channel& channel) {
    return channel.joint == joint && is_rotation(channel);
  });
}

std::string side_name(Side side) { return side == Side::kLeft ? "left" : "right"; }

}  // namespace

Result<> HandMap::check(const std::string& stream, Side side, const Skeleton& glove) {
  bool all = glove.joint_of(hand_bone_of(side)) >= 0;
  for (int finger = 0; finger < kHandJoints; ++finger) {
    all = all && glove.joint_of(hand_bone(side, finger)) >= 0;
  }
  if (all) return {};
  return misuse("stream " + in_quotes(stream) + " has no " + side_name(side) +
                " hand with three joints in each finger; name the stream of a " + side_name(side) +
                " glove");
}

Result<HandMap> HandMap::bind(const std::string& stream, Side side, const Skeleton& glove,
                              const Skeleton& merged, Wrist wrist) {
  TRY(check(stream, side, glove));
  HandMap map;
  map.glove_ = &glove;
  map.merged_ = &merged;
  map.side_ = side;
  for (int finger = 0; finger < kHandJoints; ++finger) {
    TRY(map.bind_finger(side, finger, glove));
  }
  const bool measured = has_rotations(glove, glove.joint_of(hand_bone_of(side)));
  if (wrist == Wrist::kGlove && !measured) {
    return misuse("stream " + in_quotes(stream) +
                  " does not measure the wrist; write wrist = \"auto\" or \"body\"");
  }
  if (measured && wrist != Wrist::kBody) map.bind_wrist(side, glove);
  return map;
}

HandMap::Reading HandMap::reading_of(Side side, int finger, const Skeleton& glove) {
  const int joint = glove.joint_of(hand_bone(side, finger));
  const int above = glove.joint_of(bone_above(side, finger));
  return {.joint = joint,
          .above = above,
          .before = joint_at(glove, above).T_world_joint,
          .after = joint_at(glove, joint).T_world_joint.conjugate()};
}

Result<> HandMap::bind_finger(Side side, int finger, const Skeleton& glove) {
  const std::size_t i = finger;
  read_[i] = reading_of(side, finger, glove);
  Turning& turning = turn_[i];
  turning.joint = merged_->joint_of(hand_bone(side, finger));
  turning.before = T_above(*merged_, turning.joint).conjugate();
  turning.after = joint_at(*merged_, turning.joint).T_world_joint;
  const int above = merged_->joint_of(bone_above(side, finger));
  int j = joint_at(*merged_, turning.joint).parent;
  for (; j >= 0 && j != above; j = joint_at(*merged_, j).parent) {
    stiff_.emplace_back(j, local_from_canonical(*merged_, j));
  }
  if (j == above) return {};
  return fail("joint " + in_quotes(joint_at(*merged_, turning.joint).name) + " of skeleton " +
              in_quotes(merged_->name) + " is a finger joint, but not below " +
              in_quotes(joint_at(*merged_, above).name) + "; correct its parent or its name");
}

// A glove whose skeleton begins with the hand measures the wrist relative to the forearm: identity
// is a straight wrist.
void HandMap::bind_wrist(Side side, const Skeleton& glove) {
  const Bone forearm = side == Side::kLeft ? Bone::kLeftLowerArm : Bone::kRightLowerArm;
  Reading& reading = read_[kWrist];
  reading.joint = glove.joint_of(hand_bone_of(side));
  reading.above = glove.joint_of(forearm);
  const Quaterniond& T = joint_at(glove, reading.joint).T_world_joint;
  reading.before = reading.above < 0 ? T : joint_at(glove, reading.above).T_world_joint;
  reading.after = T.conjugate();
  Turning& turning = turn_[kWrist];
  turning.joint = merged_->joint_of(hand_bone_of(side));
  turning.before = T_above(*merged_, turning.joint).conjugate();
  turning.after = joint_at(*merged_, turning.joint).T_world_joint;
}

RT_SAFE HandPose HandMap::read(const Frame& glove) const noexcept {
  std::array<Quaterniond, kMaxJoints> world;
  for (std::size_t j = 0; j < glove_->joints.size(); ++j) {
    const int parent = glove_->joints[j].parent;
    const Quaterniond local = to_eigen_double(glove.rotation_xyzw[j]);
    world[j] = parent < 0 ? local : world[parent] * local;
  }
  HandPose pose;
  for (std::size_t i = 0; i < kHandTurns; ++i) {
    const Reading& reading = read_[i];
    if (reading.joint < 0) continue;
    const std::size_t joint = reading.joint;
    Quaterniond turn = world[joint];
    if (reading.above >= 0)
      turn = world[static_cast<std::size_t>(reading.above)].conjugate() * turn;
    pose.turn[i] = (reading.before * turn * reading.after).normalized();
    // false for a rotation that is none: not finite, or all zero
    const bool usable = pose.turn[i].norm() > 0.5;
    pose.valid[i] = glove.valid[joint] && usable;
  }
  return pose;
}

RT_SAFE void HandMap::write(const HandPose& pose, Frame& frame) const noexcept {
  if (pose.valid.none()) return;
  for (const auto& [joint, rotation] : stiff_) {
    set_rotation(*merged_, joint, rotation, frame);
    frame.valid.set(joint);
  }
  for (std::size_t i = 0; i < kHandTurns; ++i) {
    const Turning& turning = turn_[i];
    if (turning.joint < 0 || !pose.valid[i]) continue;
    set_rotation(*merged_, turning.joint, turning.before * pose.turn[i] * turning.after, frame);
    frame.valid.set(turning.joint);
  }
}

HandPose HandMap::relaxed() const {
  HandAngles angles{};
  for (std::size_t joint = 0; joint < kHandJoints; ++joint) {
    const bool thumb = joint < kFingerJoints;
    const auto& at_rest = thumb ? kThumbAtRest_rad : kFingerAtRest_rad;
    angles[3 * joint] = at_rest[joint % kFingerJoints];
  }
  const Skeleton hand = hand_skeleton(side_);
  Frame frame;
  set_hand_angles(hand, angles, frame);
  HandMap map;
  map.glove_ = &hand;
  for (int finger = 0; finger < kHandJoints; ++finger) {
    map.read_[finger] = reading_of(side_, finger, hand);
  }
  HandPose pose = map.read(frame);
  pose.valid.set(kWrist);
  return pose;
}

}  // namespace posed::merge
