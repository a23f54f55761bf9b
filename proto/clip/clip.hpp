// Clip: a recorded motion as numbers, whatever its file looks like. Channel values keep the file's
// order. Angles are in radians and lengths in metres, whatever units the file uses. Cold.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "proto/frame/hand_shape.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/frame/timecode.hpp"
#include "proto/rig/recognise.hpp"
#include "proto/rig/up.hpp"

namespace posed::clip {

using ChannelMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct ClipFile;  // proto/clip/format.hpp

struct Clip {
  std::string path;
  std::shared_ptr<const Skeleton> skeleton;
  double frame_rate_hz = 0.0;
  // [frames x Skeleton::channels], rad and m; NaN where a hand CSV has no value.
  ChannelMatrix channels;
  std::vector<double> time_s{};  // [frame], increasing; empty: evenly spaced, from 0
  // [frame], empty where a frame's is not known; empty vector: no frame has one.
  std::vector<Timecode> timecode{};
  std::vector<std::string> warnings;  // one sentence for each thing that was read leniently
  // Unit and upward axis of the file, kept so that the clip can be written back in them. Skeleton
  // and channels have +Y up.
  double metres_per_unit = 0.01;
  UpAxis up = UpAxis::kPlusY;
  // What was recognised of the file's figure, in the file's axes; null where the format knows it.
  std::shared_ptr<const rig::Rig> rig{};

  [[nodiscard]] int frames() const { return static_cast<int>(channels.rows()); }
  // When the frame is [s].
  [[nodiscard]] double time_of_s(int index) const {
    return time_s.empty() ? index / frame_rate_hz : time_s[static_cast<std::size_t>(index)];
  }
  // The pose, with that as its device time; the stream is not set.
  [[nodiscard]] Frame frame(int index) const;
};

// Facts that a file may lack and a user can supply. The table (format.hpp) says which of them a
// format accepts; any other that is given is refused.
struct ReadOptions {
  // The file of the skeleton, for a format that keeps it apart; empty: skeleton_beside().
  std::filesystem::path skeleton{};
  // Rate of a format that does not state it; empty: its usual one.
  std::optional<double> rate_hz{};
  // Unit of length; empty: the file's if its format states it, then the profile's, otherwise
  // recognised by the figure's legs.
  std::optional<double> metres_per_unit{};
  // Axis that points up in a format that does not state it; empty: recognised by the figure.
  std::optional<UpAxis> up{};
  // Axis that the zero pose faces, where neither names nor feet say which side is left; empty:
  // recognised.
  std::optional<Eigen::Vector3d> facing{};
  // Name of a skeleton profile, or a file (.toml) that `posed inspect --write` made; empty: found
  // by the joints' names.
  std::string profile{};
  std::optional<Side> hand{};                 // side of a hand that does not state it; empty: right
  std::string hand_shape{kDefaultHandShape};  // bones of a hand of which a file has only the angles
};

// Reads a clip of any format of the table (format.hpp), with all its frames. Errors name file and
// line.
Result<Clip> read_clip(const std::filesystem::path& path, const ReadOptions& options = {});

// Reads a clip from memory. The extension of its name says the format.
Result<Clip> parse_clip(ClipFile file, const ReadOptions& options = {});

// Keeps frames [first, end) of the clip, with their times from 0 on and their timecodes.
void keep_frames(Clip& clip, int first, int end);

// Writes a clip in the format that the extension of `path` says. An error leaves no file.
Result<> write_clip(const Clip& clip, const std::filesystem::path& path);

// True when some frame lies more than a tenth of a step off the even clock at `rate_hz` that a BVH
// assumes.
[[nodiscard]] bool has_uneven_times(const std::vector<double>& time_s, double rate_hz);

// True when channels rotate in a frame other than the joint's own, which a BVH cannot express.
[[nodiscard]] bool is_acclaim(const Skeleton& skeleton);

// Returns the same motion in centimetres with Z, Y, X rotation channels on every joint (Z
// outermost). An Acclaim joint with few degrees of freedom then can hold any rotation.
[[nodiscard]] Clip with_zyx_channels(const Clip& clip);

// Writes `clip` as BVH in its own unit and axes, with its own joint names, hierarchy, channel order
// and rate. An Acclaim skeleton becomes a BVH with ZYX rotation channels on every joint.
Result<> write_bvh(const Clip& clip, const std::filesystem::path& path);

}  // namespace posed::clip
