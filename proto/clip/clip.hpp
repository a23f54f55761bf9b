// Clip: a recorded motion as it stands in its file. Channel values keep the file's order; angles
// are in radians and lengths in metres, so that nothing downstream asks for units.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "proto/frame/hand_shape.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::clip {

using ChannelMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct Clip {
  std::string path;
  std::shared_ptr<const Skeleton> skeleton;
  double frame_rate_hz = 0.0;
  ChannelMatrix channels;             // [frames x Skeleton::channels], rad and m; a hand CSV's
                                      // missing value is NaN
  std::vector<double> time_s{};       // [frame], increasing; empty: even, from 0 (hand CSV)
  std::vector<std::string> warnings;  // one sentence each: read leniently, and how
  double metres_per_unit = 0.01;      // of the file, kept for writing the same file back

  [[nodiscard]] int frames() const { return static_cast<int>(channels.rows()); }
  [[nodiscard]] Frame frame(int index) const;  // pose and index-derived device time; no stream
};

struct ReadOptions {
  std::filesystem::path asf{};  // skeleton of an AMC; empty: NN.asf beside NN_MM.amc
  double amc_rate_hz = 120.0;   // an AMC carries no rate
  // Of a BVH; empty: the profile's, else found from the figure's height.
  std::optional<double> metres_per_unit{};
  std::string profile{};       // named skeleton profile; empty: found by joint names
  std::optional<Side> hand{};  // whose a hand CSV is (default right), which hand of a body to take
  std::string hand_shape{kDefaultHandShape};  // of a hand CSV
  double hand_rate_hz = 30.0;                 // of a hand CSV without times
};

// By extension: .bvh, .amc or .csv (a hand). Errors name file and line.
[[nodiscard]] Result<Clip> read_clip(const std::filesystem::path& path,
                                     const ReadOptions& options = {});

// Some frame is more than a tenth of a step off the even clock at `rate_hz` that a BVH has.
[[nodiscard]] bool has_uneven_times(const std::vector<double>& time_s, double rate_hz);

// Its channels turn in frames that a BVH has not.
[[nodiscard]] bool is_acclaim(const Skeleton& skeleton);

// The same motion with Z, Y, X rotation channels on every joint (Z outermost), in centimetres, so
// that a rotation that an Acclaim joint's few degrees of freedom could not make can be written.
[[nodiscard]] Clip with_zyx_channels(const Clip& clip);

// Writes `clip` as BVH in its own units with its own joint names, hierarchy, channel order and
// rate. An Acclaim skeleton becomes a BVH with ZYX rotation channels on every joint.
[[nodiscard]] Result<> write_bvh(const Clip& clip, const std::filesystem::path& path);

}  // namespace posed::clip
