// Outlet: what the publisher keeps of one stream: its topics, its reused messages, its counts.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "daemon/publish/encode.hpp"
#include "daemon/publish/histogram.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/publish/shed_tally.hpp"

namespace posed::publish {

// The topics and frame message under one published name; a stream has a second one for its raw
// input.
struct Channel {
  Channel(const std::string& name, const StreamInfo& info);

  std::string pose_topic, skeleton_topic, sensor_topic, event_topic;
  FrameEncoder frames;
  SampleEncoder samples;
  std::optional<v1::Skeleton> skeleton;
  // When it is to be sent next: at once when somebody subscribes, but not over and over.
  std::int64_t skeleton_sent_ns = 0;
  std::int64_t skeleton_due_ns = 0;
};

struct Outlet {
  explicit Outlet(StreamInfo stream_info);

  // Adds the frame's times, which its stamps hold, to the percentiles of this second. Stale frames
  // repeat old times and are left out.
  void measure(const Frame& frame, const StageStamps& stamps) noexcept;
  // Fills `stats` and begins the next second.
  void report(v1::StreamStats& stats, double seconds_since);

  StreamInfo info;
  Channel styled;
  std::optional<Channel> raw;
  std::uint64_t frames = 0;
  std::uint64_t samples = 0;
  std::uint64_t frames_reported = 0;
  // Of the last frame.
  std::uint16_t lag_frames = 0;
  float lag_ms = 0.0F;
  std::array<char, kMaxLabel> label{};
  float label_probability = 0.0F;
  ClockMapping clock;
  LatencyHistogram decode, style, publish;
  ShedTally shed;
};

}  // namespace posed::publish
