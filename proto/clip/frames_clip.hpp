// FramesClip: builds a clip from published frames, added one after the other. A frame carries
// rotations, the angles of its channels and the position of its root joint. Other position channels
// of the skeleton keep the joint's offset.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/frame/frame.hpp"

namespace posed::clip {

// Drops every second entry, from the second one on; each has `width` values.
template <typename Value>
void drop_every_second(std::vector<Value>& values, std::size_t width = 1) {
  std::size_t kept = 0;
  for (std::size_t at = 0; at < values.size(); at += 2 * width, kept += width) {
    std::copy_n(values.begin() + std::ptrdiff_t(at), width, values.begin() + std::ptrdiff_t(kept));
  }
  values.resize(kept);
}

class FramesClip {
 public:
  explicit FramesClip(const std::shared_ptr<const Skeleton>& skeleton);

  // Adds a frame of the skeleton. A channel without a value becomes NaN.
  void add(const Frame& frame) { add(frame, frame.timecode); }
  void add(const Frame& frame, const Timecode& timecode);

  // Drops every second frame, from the second one on.
  void halve();

  // `time_s` holds the time of every frame, increasing. `rate_hz` is the rate of the clip; 0: one
  // over the median step. Fails with fewer than two frames.
  Result<Clip> finish(const std::string& path, double rate_hz, std::vector<double> time_s) const;

 private:
  void add_angles(const Frame& frame);
  void add_root_position(const Frame& frame);

  std::shared_ptr<const Skeleton> skeleton_;
  bool exact_;  // frames give the channel values themselves, so nothing is recomputed
  int moving_;  // the joint (root_joint or above it) whose position channels are written
  std::vector<double> row_;  // [channel]
  std::vector<double> values_;
  std::vector<Timecode> timecode_;  // [frame]
};

// FrameTimes: when the frames of such a clip were.
class FrameTimes {
 public:
  void add(const Header& header) {
    arrival_ns_.push_back(header.arrival_ns);
    device_ns_.push_back(header.device_ns);
  }
  void halve();  // as FramesClip::halve()
  [[nodiscard]] std::size_t size() const { return arrival_ns_.size(); }
  // Since the first one: device times if all frames have them and they increase, because a device's
  // time restarts with each link; else arrival times.
  [[nodiscard]] std::vector<double> in_seconds() const;

 private:
  std::vector<std::int64_t> arrival_ns_, device_ns_;
};

// Whether the first frame does not belong to the motion. Some converters put the figure's rest pose
// in front (CMU's cgspeed BVH files), so the step to the second frame is larger than any person
// moves. `frame` gives each of so many frames of a skeleton with this root, and a frame stays as it
// is while the next one is asked for.
[[nodiscard]] bool begins_with_added_pose(const Clip& clip);
[[nodiscard]] bool begins_with_added_pose(int frames, int root_joint,
                                          const std::function<const Frame&(int)>& frame);

// Fills every missing value with the value before it, at the start with the channel's first one.
// Reports the number in `warnings`. For formats that cannot hold missing values.
void hold_missing(Clip& clip);

// Repeats the frame before a gap in the clip's times as often as frames are missing there, so that
// an even spacing keeps the time; a gap of more than kMaxHeld_s is cut out. Says in `warnings`
// how many are missing, and where. For formats without times.
inline constexpr double kMaxHeld_s = 60.0;
void hold_gaps(Clip& clip);

}  // namespace posed::clip
