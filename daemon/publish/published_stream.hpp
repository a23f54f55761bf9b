// PublishedStream: the publisher's state for one stream: its topics, its reused messages, its
// counters.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/publish/duration_buckets.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/publish/shed_tally.hpp"
#include "daemon/publish/stream_figures.hpp"
#include "daemon/system/priority_mutex.hpp"
#include "drivers/driver.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/frame.hpp"
#include "proto/frame/rt_safe.hpp"
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

// Percentiles of durations in fixed memory. Each bucket is an eighth of an octave wide, so a
// percentile is at most 9 % too high; the maximum is exact.
class LatencyHistogram {
 public:
  // Negative durations count as 0.
  RT_SAFE void add(std::int64_t duration_ns) noexcept {
    const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(duration_ns, 0));
    ++buckets_[bucket(value)];
    ++count_;
    max_ns_ = std::max(max_ns_, value);
  }

  // The duration that the fraction `p` of all durations does not exceed [us]; 0 if there are none.
  [[nodiscard]] double percentile_us(double p) const noexcept {
    const auto wanted = static_cast<std::uint64_t>(p * static_cast<double>(count_));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      seen += buckets_[i];
      if (seen > wanted) return static_cast<double>(std::min(upper_ns(i), max_ns_)) * 1e-3;
    }
    return max_us();
  }
  [[nodiscard]] double max_us() const noexcept { return static_cast<double>(max_ns_) * 1e-3; }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

  void clear() noexcept { *this = {}; }

 private:
  // Values below 8 have a bucket each; above, each power of two has 8 buckets, chosen by the three
  // bits after the leading one.
  static constexpr std::size_t kBuckets = 8 + 61 * 8;
  [[nodiscard]] static std::size_t bucket(std::uint64_t value) noexcept {
    if (value < 8) return value;
    const int exponent =
        static_cast<int>(std::bit_width(value)) - 4;  // value >> exponent is in 8..15
    return static_cast<std::size_t>(exponent) * 8 + static_cast<std::size_t>(value >> exponent);
  }
  [[nodiscard]] static std::uint64_t upper_ns(std::size_t bucket) noexcept {
    if (bucket < 16) return bucket;
    const std::size_t exponent = bucket / 8 - 1;
    return ((std::uint64_t{bucket % 8 + 8} + 1) << exponent) - 1;
  }

  std::array<std::uint32_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  std::uint64_t max_ns_ = 0;
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
