#include "proto/message/skeleton_message.hpp"

#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/text/clean.hpp"

namespace posed::message {
namespace {

constexpr std::size_t kMaxNameBytes = 128;
constexpr int kMaxCapsules = 4096;
constexpr double kUnitTolerance = 1e-3;  // of the squared length of a rotation

std::unexpected<Error> wrong(const std::string& what) {
  return fail("the skeleton of the message " + what + "; it cannot be used");
}

// Whether every list has as many entries as the joints and channels need.
bool lists_fit(const v1::Skeleton& message) {
  const int joints = message.joint_name_size();
  return message.parent_size() == joints && message.offset_m_size() == 3 * joints &&
         message.humanoid_bone_size() == joints &&
         message.t_world_joint_xyzw_size() == 4 * joints &&
         (message.end_site_m_size() == 3 * joints || message.end_site_m().empty()) &&
         message.capsule_joint_size() <= kMaxCapsules &&
         message.capsule_m_size() == 7 * message.capsule_joint_size() &&
         std::cmp_equal(message.channel_axis().size(), message.channel_joint_size());
}

bool is_length(const Eigen::Vector3d& offset_m) {
  return offset_m.allFinite() && offset_m.cwiseAbs().maxCoeff() <= kMaxPosition_m;
}

// The hands that posed makes itself, which a message shows only in part; null for other ids.
std::shared_ptr<const Skeleton> known_hand(std::uint32_t id) {
  for (const HandShape& shape : hand_shapes()) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      auto hand = std::make_shared<const Skeleton>(hand_skeleton(side, shape));
      if (hand->id == id) return hand;
    }
  }
  return nullptr;
}

Result<> read_joint(const v1::Skeleton& message, int j, Joint& joint) {
  joint.name = clean(message.joint_name(j), kMaxNameBytes);
  joint.parent = message.parent(j);
  if (joint.parent >= j || (joint.parent < 0) != (j == 0)) {
    return wrong("has a joint (" + joint.name + ") whose parent does not precede it");
  }
  for (int k = 0; k < 3; ++k) joint.offset_m[k] = message.offset_m(3 * j + k);
  if (!message.end_site_m().empty() && !std::isnan(message.end_site_m(3 * j))) {
    joint.end_site_m.emplace();
    for (int k = 0; k < 3; ++k) (*joint.end_site_m)[k] = message.end_site_m(3 * j + k);
  }
  if (!is_length(joint.offset_m) || (joint.end_site_m && !is_length(*joint.end_site_m))) {
    return wrong("has a bone (" + joint.name + ") without a possible length");
  }
  Quatf xyzw{};
  for (int k = 0; k < 4; ++k) xyzw[k] = message.t_world_joint_xyzw(4 * j + k);
  joint.T_world_joint = to_eigen(xyzw).cast<double>();
  if (!(std::abs(joint.T_world_joint.squaredNorm() - 1.0) <= kUnitTolerance)) {
    return wrong("stands in no T-pose at its joint " + joint.name);
  }
  joint.T_world_joint.normalize();
  if (!message.humanoid_bone(j).empty()) joint.bone = bone_from_name(message.humanoid_bone(j));
  return {};
}

Result<> read_channels(const v1::Skeleton& message, Skeleton& skeleton) {
  for (int c = 0; c < message.channel_joint_size(); ++c) {
    const auto axis = std::string_view("xyz").find(message.channel_axis()[c]);
    const std::uint32_t joint = message.channel_joint(c);
    if (axis == std::string_view::npos || joint >= skeleton.joints.size()) {
      return wrong("has a channel of no joint or axis");
    }
    skeleton.channels.push_back(
        {.joint = static_cast<std::uint16_t>(joint), .axis = static_cast<Axis>(axis)});
  }
  return {};
}

Result<> read_capsules(const v1::Skeleton& message, Skeleton& skeleton) {
  for (int c = 0; c < message.capsule_joint_size(); ++c) {
    const auto value = [&](int k) { return static_cast<double>(message.capsule_m(7 * c + k)); };
    const std::uint32_t joint = message.capsule_joint(c);
    const JointCapsule capsule{.joint = static_cast<std::uint16_t>(joint),
                               .from_m = {value(0), value(1), value(2)},
                               .to_m = {value(3), value(4), value(5)},
                               .radius_m = value(6)};
    if (joint >= skeleton.joints.size() || !is_length(capsule.from_m) || !is_length(capsule.to_m) ||
        !(capsule.radius_m > 0.0 && capsule.radius_m <= kMaxPosition_m)) {
      return wrong("has a capsule of no joint or size");
    }
    skeleton.capsules.push_back(capsule);
  }
  return {};
}

}  // namespace

v1::Skeleton skeleton_message(const std::string& stream, const Skeleton& skeleton, double rate_hz) {
  const Eigen::Vector3d no_tip_m =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  v1::Skeleton message;
  message.set_stream(stream);
  message.set_id(skeleton.id);
  message.set_name(clean(skeleton.name));  // a file's name need not be UTF-8, a message's must
  message.set_root_joint(static_cast<std::uint32_t>(skeleton.root_joint));
  message.set_rate_hz(rate_hz);
  for (const Joint& joint : skeleton.joints) {
    message.add_joint_name(clean(joint.name));
    message.add_parent(joint.parent);
    for (const double value : joint.offset_m) message.add_offset_m(static_cast<float>(value));
    const Eigen::Vector3d tip_m = joint.end_site_m.value_or(no_tip_m);
    for (const double value : tip_m) message.add_end_site_m(static_cast<float>(value));
    message.add_humanoid_bone(joint.bone ? std::string(bone_name(*joint.bone)) : std::string());
    for (const float value : from_eigen(joint.T_world_joint)) message.add_t_world_joint_xyzw(value);
  }
  for (const Channel& channel : skeleton.channels) {
    if (channel.translation) continue;
    message.add_channel_joint(channel.joint);
    message.mutable_channel_axis()->push_back("xyz"[static_cast<std::size_t>(channel.axis)]);
  }
  for (const JointCapsule& capsule : skeleton.capsules) {
    message.add_capsule_joint(capsule.joint);
    for (const double value : capsule.from_m) message.add_capsule_m(static_cast<float>(value));
    for (const double value : capsule.to_m) message.add_capsule_m(static_cast<float>(value));
    message.add_capsule_m(static_cast<float>(capsule.radius_m));
  }
  return message;
}

Result<std::shared_ptr<const Skeleton>> skeleton_from(const v1::Skeleton& message) {
  const int joints = message.joint_name_size();
  if (joints < 1 || joints > kMaxJoints || message.channel_joint_size() > kMaxChannels ||
      !lists_fit(message)) {
    return wrong("has lists that do not fit " + std::to_string(joints) + " joints");
  }
  if (message.root_joint() >= static_cast<std::uint32_t>(joints)) return wrong("has no root joint");
  if (auto hand = known_hand(message.id())) return hand;
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = clean(message.name(), kMaxNameBytes);
  skeleton->root_joint = static_cast<int>(message.root_joint());
  skeleton->joints.resize(joints);
  for (int j = 0; j < joints; ++j) {
    TRY(read_joint(message, j, skeleton->joints[j]));
  }
  TRY(read_channels(message, *skeleton));
  TRY(read_capsules(message, *skeleton));
  TRY(skeleton->finish());
  return skeleton;
}

}  // namespace posed::message
