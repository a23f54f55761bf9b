// Clip: a recorded motion read from a file. Channel values keep the file's order. Angles are in
// radians and lengths in metres, whatever units the file uses.
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
  // [frames x Skeleton::channels], rad and m; NaN where a hand CSV has no value.
  ChannelMatrix channels;
  std::vector<double> time_s{};       // [frame], increasing; empty: evenly spaced, from 0
  std::vector<std::string> warnings;  // one sentence for each thing that was read leniently
  // Unit of the file, kept so that the clip can be written back in it.
  double metres_per_unit = 0.01;

  [[nodiscard]] int frames() const { return static_cast<int>(channels.rows()); }
  // The pose, with a device time from the index; the stream is not set.
  [[nodiscard]] Frame frame(int index) const;
};

struct ReadOptions {
  std::filesystem::path asf{};  // the skeleton of an AMC; empty: NN.asf beside NN_MM.amc
  double amc_rate_hz = 120.0;   // AMC files do not state a rate
  // Unit of a BVH; empty: the profile's, otherwise guessed from the figure's height.
  std::optional<double> metres_per_unit{};
  std::string profile{};       // name of a skeleton profile; empty: found by joint names
  std::optional<Side> hand{};  // side of a hand CSV (default right); which hand to take from a body
  std::string hand_shape{kDefaultHandShape};  // hand shape for a hand CSV
  double hand_rate_hz = 30.0;                 // rate of a hand CSV without times
};

// Reads a .bvh, .amc or .csv (a hand), chosen by extension. Errors name file and line.
[[nodiscard]] Result<Clip> read_clip(const std::filesystem::path& path,
                                     const ReadOptions& options = {});

// True when some frame lies more than a tenth of a step off the even clock at `rate_hz` that a BVH
// assumes.
[[nodiscard]] bool has_uneven_times(const std::vector<double>& time_s, double rate_hz);

// True when channels rotate in a frame other than the joint's own, which a BVH cannot express.
[[nodiscard]] bool is_acclaim(const Skeleton& skeleton);

// Returns the same motion in centimetres with Z, Y, X rotation channels on every joint (Z
// outermost). An Acclaim joint with few degrees of freedom then can hold any rotation.
[[nodiscard]] Clip with_zyx_channels(const Clip& clip);

// Writes `clip` as BVH in its own unit, with its own joint names, hierarchy, channel order and
// rate. An Acclaim skeleton becomes a BVH with ZYX rotation channels on every joint.
[[nodiscard]] Result<> write_bvh(const Clip& clip, const std::filesystem::path& path);

}  // namespace posed::clip
