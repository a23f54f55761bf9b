#include "proto/clip/figure.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "proto/clip/text.hpp"

namespace posed::clip {

namespace {

Eigen::Vector3d channel_position(const Skeleton& skeleton, int joint,
                                 std::span<const double> values) {
  const std::span<const Channel> channels = channels_of(skeleton, joint);
  return local_position(skeleton.joints[joint], channels,
                        values.data() + (channels.data() - skeleton.channels.data()));
}

// True when the position channels of a joint below the root are to be added to its OFFSET.
bool is_added(const Skeleton& skeleton, int joint, std::span<const double> first) {
  constexpr double kNothing = 0.02;  // of the bone's length
  if (skeleton.joints[joint].parent < 0) return false;
  const auto channels = channels_of(skeleton, joint);
  return std::ranges::count(channels, true, &Channel::translation) == 3 &&
         channel_position(skeleton, joint, first).norm() <
             kNothing * skeleton.joints[joint].offset_m.norm();
}

}  // namespace

Eigen::Vector3d settled_offset(const Skeleton& skeleton, int joint, std::span<const double> first) {
  return is_added(skeleton, joint, first) ? skeleton.joints[joint].offset_m
                                          : channel_position(skeleton, joint, first);
}

std::vector<int> sample_frames(int frames, int joints) {
  const int most = std::clamp(rig::kMaxPoseJoints / std::max(joints, 1), 1, rig::kMaxPoses);
  const int count = std::min(frames, most);
  std::vector<int> out;
  for (int i = 0; i < count; ++i) {
    const double at = count == 1 ? 0.0 : static_cast<double>(i) * (frames - 1) / (count - 1);
    out.push_back(static_cast<int>(at));
  }
  return out;
}

rig::Rig recognise(const Skeleton& skeleton, const ChannelMatrix& sample, rig::RigInput known) {
  const int count = static_cast<int>(sample.rows());
  const auto values = [&sample](int i) {
    const auto row = sample.row(i);
    return std::span<const double>(row.data(), static_cast<std::size_t>(row.size()));
  };
  const int joints = static_cast<int>(skeleton.joints.size());
  std::vector<bool> added(joints, false);
  known.joints.clear();
  for (int j = 0; j < joints; ++j) {
    const Joint& joint = skeleton.joints[j];
    added[j] = count > 0 && is_added(skeleton, j, values(0));
    const bool settles = count > 0 && joint.parent >= 0;
    known.joints.push_back(
        {.name = joint.name,
         .parent = joint.parent,
         .offset = settles ? settled_offset(skeleton, j, values(0)) : joint.offset_m,
         .end_site = joint.end_site_m});
  }
  known.poses = {.count = count, .rotation = {}, .position = {}};
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < joints; ++j) {
      known.poses.rotation.push_back(local_rotation(skeleton, j, values(i)));
      known.poses.position.push_back(added[j] ? skeleton.joints[j].offset_m
                                              : channel_position(skeleton, j, values(i)));
    }
  }
  return rig::recognise(known);
}

void apply(const rig::Rig& rig, Skeleton& skeleton) {
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    skeleton.joints[j].bone = rig.bone[j];
    skeleton.joints[j].T_world_joint = rig.T[j];
  }
}

Result<> add_profile(const Profile& profile, const Skeleton& skeleton, rig::RigInput& known) {
  known.bones = TRY(named_bones(profile, skeleton));
  known.T = known_t(profile, skeleton);
  // +y is what the recogniser takes unless the whole clip speaks against it.
  if (!known.up && profile.up != UpAxis::kPlusY) known.up = profile.up;
  return {};
}

std::vector<char> leave_out_joints(Skeleton& skeleton, rig::Rig& rig) {
  const std::size_t count = skeleton.joints.size();
  std::vector<char> stays(count, 0);
  for (std::size_t j = count; j-- > 0;) {
    const int parent = skeleton.joints[j].parent;
    if (skeleton.joints[j].bone) stays[j] = 1;
    if (parent >= 0 && stays[j] != 0) stays[parent] = 1;
  }
  auto staying = std::ranges::count(stays, 1);
  if (count <= kMaxJoints || staying == 0 || staying > kMaxJoints) return {};
  for (std::size_t j = 1; j < count && staying < kMaxJoints; ++j) {
    if (stays[j] != 0 || stays[skeleton.joints[j].parent] == 0) continue;
    stays[j] = 1;
    ++staying;
  }
  std::vector<int> place(count, -1);
  std::vector<Joint> joints;
  for (std::size_t j = 0; j < count; ++j) {
    if (stays[j] == 0) continue;
    place[j] = static_cast<int>(joints.size());
    const std::size_t to = joints.size();
    rig.bone[to] = rig.bone[j];
    rig.T[to] = rig.T[j];
    rig.evidence[to] = rig.evidence[j];
    joints.push_back(std::move(skeleton.joints[j]));
    if (j > 0) joints.back().parent = place[joints.back().parent];
  }
  std::vector<char> channel_stays;
  std::vector<Channel> channels;
  for (Channel channel : skeleton.channels) {
    channel_stays.push_back(stays[channel.joint]);
    if (stays[channel.joint] == 0) continue;
    channel.joint = static_cast<std::uint16_t>(place[channel.joint]);
    channels.push_back(channel);
  }
  rig.bone.resize(joints.size());
  rig.T.resize(joints.size());
  rig.evidence.resize(joints.size());
  skeleton.joints = std::move(joints);
  skeleton.channels = std::move(channels);
  return channel_stays;
}

std::string left_out(std::size_t before, std::size_t now) {
  return "has " + std::to_string(before) + " joints; of those that are no bones, " +
         std::to_string(before - now) + " were left out";
}

std::vector<double> turn_axes(const Eigen::Matrix3d& turn, Skeleton& skeleton) {
  for (Joint& joint : skeleton.joints) {
    joint.offset_m = turn * joint.offset_m;
    if (joint.end_site_m) joint.end_site_m = turn * *joint.end_site_m;
    joint.T_world_joint = joint.T_world_joint * Eigen::Quaterniond(turn).conjugate();
  }
  // The axes of a joint with a frame of its own turn with that.
  std::vector<char> framed;
  for (Joint& joint : skeleton.joints) {
    framed.push_back(joint.channel_frame.isApprox(Eigen::Quaterniond::Identity()) ? 0 : 1);
    if (framed.back() != 0) joint.channel_frame = Eigen::Quaterniond(turn) * joint.channel_frame;
  }
  std::vector<double> factors;
  for (Channel& channel : skeleton.channels) {
    if (framed[channel.joint] != 0 && !channel.translation) {
      factors.push_back(1.0);
      continue;
    }
    const Eigen::Vector3d to = turn * unit(channel.axis);
    int axis = 0;
    to.cwiseAbs().maxCoeff(&axis);
    channel.axis = static_cast<Axis>(axis);
    factors.push_back(to[axis] < 0.0 ? -1.0 : 1.0);
  }
  return factors;
}

std::optional<double> metres_of_unit(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, double>, 6> kNames{
      {{"m", 1.0}, {"dm", 0.1}, {"cm", 0.01}, {"mm", 0.001}, {"inch", 0.0254}, {"foot", 0.3048}}};
  const auto* const named =
      std::ranges::find(kNames, text, &std::pair<std::string_view, double>::first);
  if (named != kNames.end()) return named->second;
  const auto metres = parse_number(text);
  if (!metres || !(*metres >= 1e-6 && *metres <= 1e6)) return std::nullopt;
  return metres;
}

}  // namespace posed::clip
