#include "models/merge/merged_skeleton.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/text/clean.hpp"

namespace posed::merge {
namespace {

class Merger {
 public:
  Merger(const Skeleton& body, const std::array<const Skeleton*, 2>& gloves)
      : body_(body), gloves_(gloves) {
    with_channels_ = std::ranges::any_of(body.channels, is_rotation);
  }

  Result<MergedSkeleton> merge() {
    merged_.name = body_.name + " with hands";
    for (int j = 0; j < std::ssize(body_.joints); ++j) add_body_joint(j);
    merged_.root_joint = joint_of_[body_.root_joint];
    if (auto ok = merged_.finish(); !ok) {
      return fail("with the hands " + ok.error().message + " (the body alone has " +
                  std::to_string(body_.joints.size()) + ")");
    }
    return MergedSkeleton{.skeleton = std::make_shared<const Skeleton>(std::move(merged_)),
                          .joint_of = std::move(joint_of_),
                          .angle_of = std::move(angle_of_)};
  }

 private:
  [[nodiscard]] int next() const { return static_cast<int>(std::ssize(merged_.joints)); }

  void add_channel(Channel channel, int joint) {
    channel.joint = static_cast<std::uint16_t>(joint);
    if (is_rotation(channel)) ++angles_;
    merged_.channels.push_back(channel);
  }

  void add_body_joint(int old) {
    const int joint = next();
    Joint copy = body_.joints[old];
    if (copy.parent >= 0) copy.parent = joint_of_[copy.parent];
    const std::optional<Bone> bone = copy.bone;
    joint_of_.push_back(joint);
    merged_.joints.push_back(std::move(copy));
    for (const Channel& channel : body_.channels) {
      if (channel.joint != old) continue;
      if (is_rotation(channel)) angle_of_.push_back(angles_);
      add_channel(channel, joint);
    }
    if (bone && body_.joint_of(*bone) == old) add_fingers_below(*bone, joint);
  }

  // The finger joints directly below this bone that the body does not have, each with its own.
  void add_fingers_below(Bone bone, int joint) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      const Skeleton* const glove = gloves_[static_cast<std::size_t>(side)];
      if (glove == nullptr) continue;
      for (int finger = 0; finger < kHandJoints; ++finger) {
        const Bone wanted = hand_bone(side, finger);
        if (bone_above(side, finger) != bone || body_.joint_of(wanted) >= 0) continue;
        add_finger(side, finger, joint);
        add_fingers_below(wanted, next() - 1);
      }
    }
  }

  // In the body's hand the whole glove is turned from its own hand frame into the body's; so each
  // finger's rotation has the values of the glove's channels.
  void add_finger(Side side, int finger, int parent) {
    const Skeleton& glove = *gloves_[static_cast<std::size_t>(side)];
    const int from = glove.joint_of(hand_bone(side, finger));
    const auto& wrist = glove.joints[glove.joint_of(hand_bone_of(side))];
    const auto& hand = body_.joints[body_.joint_of(hand_bone_of(side))];
    const Eigen::Quaterniond turn = hand.T_world_joint.conjugate() * wrist.T_world_joint;
    const Joint& original = glove.joints[from];
    Joint joint;
    joint.name = bone_name(hand_bone(side, finger));
    joint.parent = parent;
    joint.bone = hand_bone(side, finger);
    joint.offset_m = turn * offset_m(glove, from, glove.joint_of(bone_above(side, finger)));
    if (original.end_site_m) joint.end_site_m = turn * *original.end_site_m;
    joint.channel_frame = turn * original.channel_frame;
    joint.T_world_joint = original.T_world_joint * turn.conjugate();
    const int added = next();
    merged_.joints.push_back(std::move(joint));
    for (const Channel& channel : glove.channels) {
      if (with_channels_ && channel.joint == from && is_rotation(channel))
        add_channel(channel, added);
    }
  }

  // From joint `above` to `joint` in the T-pose, in the frame of `above`.
  static Eigen::Vector3d offset_m(const Skeleton& glove, int joint, int above) {
    Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
    for (int j = joint; j != above && j >= 0;) {
      const Joint& one = glove.joints[j];
      j = one.parent;
      if (j >= 0) sum_m += glove.joints[j].T_world_joint * one.offset_m;
    }
    return glove.joints[above].T_world_joint.conjugate() * sum_m;
  }

  const Skeleton& body_;
  const std::array<const Skeleton*, 2>& gloves_;
  bool with_channels_ = false;
  Skeleton merged_;
  std::vector<int> joint_of_, angle_of_;
  int angles_ = 0;
};

}  // namespace

Result<MergedSkeleton> merge_skeletons(const Skeleton& body,
                                       const std::array<const Skeleton*, 2>& gloves) {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    if (gloves[static_cast<std::size_t>(side)] == nullptr) continue;
    const Bone hand = hand_bone_of(side);
    if (body.joint_of(hand) < 0) {
      return fail("skeleton " + in_quotes(body.name) + " has no " + std::string(bone_name(hand)) +
                  " on which the fingers could be; name its joints as VRM does, or leave out"
                  " this side of its merge table");
    }
  }
  return Merger(body, gloves).merge();
}

}  // namespace posed::merge
