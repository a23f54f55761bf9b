// PublishedStream: the publisher's state for one stream: its topics, its reused messages, its
// counters.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "daemon/publish/duration_buckets.hpp"
#include "daemon/publish/histogram.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/publish/shed_tally.hpp"
#include "daemon/publish/stream_figures.hpp"
#include "daemon/system/priority_mutex.hpp"
#include "drivers/driver.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/frame.hpp"
#include "proto/message/frame_message.hpp"

namespace posed::publish {

// Converts samples to the wire format (proto/wire/posed/v1/posed.proto). The message is reused, so
// encoding a sample allocates nothing.
class SampleEncoder {
 public:
  SampleEncoder(const std::string& stream, const drivers::SampleLayout& layout);
  [[nodiscard]] const v1::Sample& encode(const Sample& sample);

 private:
  v1::Sample message_;
};

// Whether a device that may be unplugged is.
[[nodiscard]] bool is_away(const pipeline::SourceCounters& source, bool comes_and_goes) noexcept;

// The topics and the frame message of one published name; a stream with raw output has a second
// one.
struct Channel {
  // `unstyled`: for the frames before the stages.
  Channel(const std::string& name, const StreamInfo& info, bool unstyled);

  std::string pose_topic, skeleton_topic, sensor_topic, event_topic;
  message::FrameEncoder frames;
  SampleEncoder samples;
  std::optional<v1::Skeleton> skeleton;
  // When the skeleton is to be sent next: soon after a subscription, but not at every one of many.
  std::int64_t skeleton_sent_ns = 0;
  std::int64_t skeleton_due_ns = 0;
};

// Publisher thread, except for set_stages(), counts(), stats() and figures(): any thread.
class PublishedStream {
 public:
  explicit PublishedStream(StreamInfo stream_info);

  // Counts a styled frame that goes out with these stamps. Its times go into the percentiles of the
  // current second, except those of a stale frame, which are old.
  void count(const Frame& frame, const StageStamps& stamps);
  void count_sample();
  // It has become stale.
  void count_silence();
  // Tells its outputs that it leaves.
  void leave_outputs() noexcept;
  void set_stages(std::vector<StageInfo> stages);

  // Published so far.
  struct Counts {
    std::uint64_t frames = 0, samples = 0;
  };
  [[nodiscard]] Counts counts() const;

  // The state at this moment, with the rates and percentiles of the last whole second.
  [[nodiscard]] v1::StreamStats stats() const;
  // The same with those of the second that ends here; starts the next one.
  [[nodiscard]] v1::StreamStats report(double seconds_since);
  [[nodiscard]] StreamFigures figures() const;

  StreamInfo info;
  Channel styled;
  std::optional<Channel> raw;
  ShedTally shed;
  std::vector<FrameOutput*> outputs;  // that want it
  bool announced = false;             // its skeleton was sent, and an event if it is a body

 private:
  // What stats() reads while the publisher continues.
  struct Now {
    Counts published;
    std::array<std::uint64_t, kQualityNames.size()> by_quality{};  // frames
    std::uint64_t silences = 0;
    std::vector<StageInfo> stages;
    // Of the last frame.
    std::uint16_t lag_frames = 0;
    float lag_ms = 0.0F;
    std::array<char, kMaxLabel> label{};
    float label_probability = 0.0F;
    Source source = Source::kDevice;
    ClockMapping clock;
  };

  void measure(const Frame& frame, const StageStamps& stamps) noexcept;
  // Everything except rates and percentiles.
  void fill(v1::StreamStats& stats) const;
  void fill_device(v1::StreamStats& stats) const;

  // The publisher is a real-time thread.
  mutable system::PriorityMutex mutex_;
  Now now_;                   // under mutex_
  v1::StreamStats reported_;  // by the last report(); under mutex_
  std::uint64_t frames_reported_ = 0, lost_reported_ = 0;
  double lossy_for_s_ = 0.0;  // how long it still counts as a stream that loses frames
  LatencyHistogram decode_, stages_, publish_;
  std::array<LatencyHistogram, kMaxStages> stage_;
  // The same since the start.
  DurationBuckets all_decode_, all_publish_;
  std::array<DurationBuckets, kMaxStages> all_stage_;
};

}  // namespace posed::publish
