#include "proto/frame/hand_skeleton.hpp"

#include <numbers>

namespace posed {
namespace {

constexpr int kFirstMirroredFinger = 3;  // ring and little, beyond the middle finger
Eigen::Quaterniond t_frame(Side side) {
  const double quarter = std::numbers::pi / 2;
  return axis_rotation(Axis::kY, side == Side::kLeft ? quarter : -quarter);
}

Joint named_joint(Side side, Bone bone, int parent) {
  Joint joint;
  joint.name = bone_name(bone);
  joint.bone = bone;
  joint.parent = parent;
  joint.T_world_joint = t_frame(side);
  return joint;
}

void add_finger(Side side, const HandShape& shape, int finger, Skeleton& skeleton) {
  const FingerShape& form = shape.fingers[finger];
  const auto along = [&](double length_m) {
    return mirrored(side, form.frame * Eigen::Vector3d(0, 0, length_m));
  };
  for (int j = 0; j < kFingerJoints; ++j) {
    const int index = hand_joint(finger, j);
    Joint joint = named_joint(side, hand_bone(side, index - 1), j == 0 ? 0 : index - 1);
    joint.offset_m = j == 0 ? mirrored(side, form.base_m) : along(form.length_m[j - 1]);
    if (j + 1 == kFingerJoints) joint.end_site_m = along(form.length_m[j]);
    joint.channel_frame = channel_frame(side, shape, finger, j);
    skeleton.joints.push_back(std::move(joint));
    for (const Axis axis : {Axis::kZ, Axis::kX, Axis::kY}) {
      const AngleRange& range = form.range[j][static_cast<std::size_t>(axis)];
      skeleton.channels.push_back({static_cast<std::uint16_t>(index), axis, false,
                                   static_cast<float>(range.min_rad),
                                   static_cast<float>(range.max_rad)});
    }
  }
}

}  // namespace

Eigen::Vector3d mirrored(Side side, const Eigen::Vector3d& right_m) noexcept {
  return side == Side::kLeft ? Eigen::Vector3d(-right_m.x(), right_m.y(), right_m.z()) : right_m;
}

// With the mirror M = diag(-1, 1, 1) and F a half turn about x, M R(x, y, z) M = R(x, -y, -z) =
// F R F^-1: a mirrored joint is the same joint in the frame (M C M) F.
Eigen::Quaterniond channel_frame(Side side, const HandShape& shape, int finger, int joint) {
  const Eigen::Quaterniond half_turn = axis_rotation(Axis::kX, std::numbers::pi);
  Eigen::Quaterniond frame = joint == 0 ? shape.fingers[finger].root : shape.fingers[finger].frame;
  bool turned = finger >= kFirstMirroredFinger;
  if (side == Side::kLeft) {
    frame = Eigen::Quaterniond(frame.w(), frame.x(), -frame.y(), -frame.z());
    turned = !turned;
  }
  return turned ? frame * half_turn : frame;
}

Skeleton hand_skeleton(Side side, const HandShape& shape) {
  Skeleton skeleton;
  skeleton.name = std::string("hand45 ") + (side == Side::kLeft ? "left " : "right ") + shape.name;
  const Bone wrist = side == Side::kLeft ? Bone::kLeftHand : Bone::kRightHand;
  skeleton.joints.push_back(named_joint(side, wrist, -1));
  for (int finger = 0; finger < kFingers; ++finger) add_finger(side, shape, finger, skeleton);
  // Cannot fail: the joints are fixed, and a shape's lengths were checked when it was read.
  if (!skeleton.finish()) std::abort();
  return skeleton;
}

std::optional<Side> hand_side(const Skeleton& skeleton) {
  if (skeleton.joints.size() != kHandSkeletonJoints || skeleton.channels.size() != kHandChannels) {
    return std::nullopt;
  }
  for (std::size_t c = 0; c < skeleton.channels.size(); ++c) {
    const Channel& channel = skeleton.channels[c];
    if (channel.translation || channel.joint != 1 + c / 3 ||
        static_cast<std::size_t>(channel.axis) != kAngleOfChannel[c] % 3) {
      return std::nullopt;
    }
  }
  for (const Side side : {Side::kLeft, Side::kRight}) {
    bool all = true;
    for (int j = 0; j < kHandJoints && all; ++j) {
      const Joint& joint = skeleton.joints[static_cast<std::size_t>(j) + 1];
      all = joint.bone == hand_bone(side, j) && joint.parent == (j % kFingerJoints == 0 ? 0 : j);
    }
    if (all) return side;
  }
  return std::nullopt;
}

HandAngles hand_angles(const Frame& frame) noexcept {
  HandAngles angles;
  for (std::size_t c = 0; c < angles.size(); ++c) {
    angles[kAngleOfChannel[c]] = static_cast<double>(frame.angle_rad[c]);
  }
  return angles;
}

void set_hand_angles(const Skeleton& skeleton, const HandAngles& angles, Frame& frame) noexcept {
  std::array<double, kHandChannels> values;
  for (std::size_t c = 0; c < values.size(); ++c) values[c] = angles[kAngleOfChannel[c]];
  pose_from_channels(skeleton, values, frame);
}

}  // namespace posed
