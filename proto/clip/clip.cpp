#include "proto/clip/clip.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "proto/clip/draft.hpp"
#include "proto/clip/format.hpp"

namespace posed::clip {
namespace {

constexpr std::array kZyx{Axis::kZ, Axis::kY, Axis::kX};
constexpr double kCentimetre_m = 0.01;

}  // namespace

Frame Clip::frame(int index) const {
  Frame frame;
  frame.header.sequence = static_cast<std::uint64_t>(index) + 1;
  frame.header.device_ns = nanoseconds(time_of_s(index));
  frame.source = Source::kFile;
  if (!timecode.empty()) frame.timecode = timecode[index];
  const auto row = channels.row(index);
  pose_from_channels(*skeleton, {row.data(), static_cast<std::size_t>(row.size())}, frame);
  return frame;
}

void keep_frames(Clip& clip, int first, int end) {
  clip.channels = ChannelMatrix(clip.channels.middleRows(first, end - first));
  const auto keep = [&](auto& values) {
    if (values.empty()) return;
    values.erase(values.begin() + end, values.end());
    values.erase(values.begin(), values.begin() + first);
  };
  keep(clip.time_s);
  keep(clip.timecode);
  const double begin_s = clip.time_s.empty() ? 0.0 : clip.time_s.front();
  for (double& time_s : clip.time_s) time_s -= begin_s;
}

bool has_uneven_times(const std::vector<double>& time_s, double rate_hz) {
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double even_s = time_s.front() + static_cast<double>(i) / rate_hz;
    if (std::abs(time_s[i] - even_s) * rate_hz > 0.1) return true;
  }
  return false;
}

Result<Clip> read_clip(const std::filesystem::path& path, const ReadOptions& options) {
  const auto loaded = TRY(load_clip(path, options));
  auto draft = TRY(loaded.format->read(loaded.file, options));
  return clip_of(std::move(draft), loaded.file.name);
}

Result<Clip> parse_clip(ClipFile file, const ReadOptions& options) {
  const Format* format = format_of(file.name);
  if (format == nullptr || format->read == nullptr) {
    return fail("is no clip posed can read; a clip is " + listed(Use::kRead), file.name);
  }
  TRY(check_options(*format, options, file.name));
  file.bytes = plain_bytes(*format, std::move(file.bytes));
  auto draft = TRY(format->read(file, options));
  return clip_of(std::move(draft), file.name);
}

Result<> write_clip(const Clip& clip, const std::filesystem::path& path) {
  const Format* format = format_of(path);
  if (format == nullptr || format->write == nullptr) {
    return misuse("is no clip posed can write; a clip is " + listed(Use::kWrite), path.string());
  }
  return format->write(clip, path);
}

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
  const auto finished = skeleton->finish();  // updates the id
  assert(finished);                          // these joints have passed before
  (void)finished;

  Clip out{.path = clip.path,
           .skeleton = skeleton,
           .frame_rate_hz = clip.frame_rate_hz,
           .channels = ChannelMatrix(clip.frames(), std::ssize(skeleton->channels)),
           .time_s = clip.time_s,
           .timecode = clip.timecode,
           .warnings = {},
           .metres_per_unit = kCentimetre_m};
  std::vector<std::array<double, 3>> near(skeleton->joints.size());
  for (int i = 0; i < clip.frames(); ++i) {
    const auto row = clip.channels.row(i);
    const std::span<const double> values(row.data(), row.size());
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
