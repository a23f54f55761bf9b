#include <algorithm>
#include <array>

#include "proto/clip/clip.hpp"

namespace posed::clip {
namespace {

constexpr std::array kZyx{Axis::kZ, Axis::kY, Axis::kX};
constexpr double kCentimetre_m = 0.01;

}  // namespace

bool is_acclaim(const Skeleton& skeleton) {
  return std::ranges::any_of(skeleton.joints, [](const Joint& joint) {
    return !joint.channel_frame.isApprox(Eigen::Quaterniond::Identity());
  });
}

Clip with_zyx_channels(const Clip& clip) {
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  std::vector<int> translations;  // source columns, in the new order of the translation channels
  skeleton->channels.clear();
  for (int j = 0; j < std::ssize(skeleton->joints); ++j) {
    skeleton->joints[j].channel_frame.setIdentity();
    for (std::size_t c = 0; c < clip.skeleton->channels.size(); ++c) {
      const Channel& channel = clip.skeleton->channels[c];
      if (channel.joint != j || !channel.translation) continue;
      skeleton->channels.push_back(channel);
      translations.push_back(static_cast<int>(c));
    }
    for (const Axis axis : kZyx) {
      skeleton->channels.push_back({.joint = static_cast<std::uint16_t>(j), .axis = axis});
    }
  }
  (void)skeleton->finish();  // cannot fail: the same joints passed before; this only updates the id

  Clip out{.path = clip.path,
           .skeleton = skeleton,
           .frame_rate_hz = clip.frame_rate_hz,
           .channels = ChannelMatrix(clip.frames(), std::ssize(skeleton->channels)),
           .time_s = clip.time_s,
           .warnings = {},
           .metres_per_unit = kCentimetre_m};
  std::vector<std::array<double, 3>> near(skeleton->joints.size());
  for (int i = 0; i < clip.frames(); ++i) {
    const auto row = clip.channels.row(i);
    const std::span<const double> values(row.data(), static_cast<std::size_t>(row.size()));
    std::size_t translation = 0;
    for (int c = 0; c < std::ssize(skeleton->channels);) {
      const Channel& channel = skeleton->channels[c];
      if (channel.translation) {
        out.channels(i, c++) = row[translations[translation++]];
        continue;
      }
      auto& angles = near[channel.joint];
      angles = channels_from_rotation(
          *skeleton, channel.joint, local_rotation(*clip.skeleton, channel.joint, values), angles);
      for (const double angle : angles) out.channels(i, c++) = angle;
    }
  }
  return out;
}

}  // namespace posed::clip
