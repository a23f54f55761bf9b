// What the hot threads count about sources and streams, for `stats`. Relaxed atomics: each one is
// written by one thread only and may be read by any thread.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "proto/frame/sink.hpp"

namespace posed::pipeline {

enum class StreamState : std::uint8_t { kWaiting, kLive, kStale, kEnded };

// Of one source. The streams of its bodies share it.
struct alignas(64) SourceCounters {
  std::array<std::atomic<std::uint64_t>, kOutcomes> outcome{};
  std::atomic<std::uint64_t> kernel_dropped{0};       // as in drivers::Chunk
  std::atomic<std::int64_t> received_ns{kNoTime_ns};  // arrival of the last good packet
  std::atomic<bool> connected{false};                 // a link to the device is open
  std::atomic<std::uint64_t> connections{0};          // links opened since the start
  std::atomic<std::int64_t> link_ns{kNoTime_ns};      // when `connected` last changed
  std::atomic<std::int64_t> used_ns{kNoTime_ns};      // arrival of the last frame or sample
};

struct alignas(64) ReaderCounters {
  std::atomic<std::uint64_t> newest{0};   // sequence of the last frame that went into the ring
  std::atomic<std::uint64_t> frames{0};   // sequence of the last decoded frame
  std::atomic<std::uint64_t> samples{0};  // sequence of the last decoded sample
  // sequence of the last sample that went into the ring
  std::atomic<std::uint64_t> newest_sample{0};
  std::atomic<std::uint64_t> dropped{0};  // frames and samples for which the ring was full
  // sequences of the last of these frames and samples
  std::atomic<std::uint64_t> last_dropped{0}, last_dropped_sample{0};
};

inline constexpr std::size_t kMaxLiveParameters = 32;  // of one stream

// As ParameterState.
struct ParameterCounter {
  std::atomic<double> now{0.0};
  std::atomic<double> target{0.0};
};

inline constexpr std::size_t kMaxReadings = 16;  // of one stream

struct ReadingCounter {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::atomic<double> now{kUnknown};
};

struct alignas(64) PipelineCounters {
  std::atomic<std::uint64_t> consumed{0};  // sequence of the last frame taken from the ring
  std::atomic<std::uint64_t> last_out{0};  // sequence of the last frame that left the stages
  std::atomic<std::uint64_t> taken{0};     // items taken from the ring
  std::atomic<std::uint64_t> shed{0};      // frames and samples skipped because newer ones waited
  std::atomic<std::uint64_t> dropped{0};   // items for which the publisher's ring was full
  std::atomic<StreamState> state{StreamState::kWaiting};
  // The live parameters of the stream's stages, in their order.
  std::array<ParameterCounter, kMaxLiveParameters> parameter{};
  // What the stages measure, in their order; NaN: unknown.
  std::array<ReadingCounter, kMaxReadings> reading{};
};

struct alignas(64) PublisherCounters {
  std::atomic<std::uint64_t> taken{0};  // items taken from the pipeline's ring
};

// Of one slot; the streams that have the slot one after the other count on.
struct StreamCounters {
  ReaderCounters reader;
  PipelineCounters pipeline;
  PublisherCounters publisher;
};

// The sequences that the next frame and sample of a stream get.
struct NextNumbers {
  std::uint64_t frame = 1, sample = 1;
};
[[nodiscard]] inline NextNumbers next_numbers(const StreamCounters& counters) noexcept {
  return {.frame = std::max(counters.reader.frames.load(std::memory_order_acquire),
                            counters.pipeline.last_out.load(std::memory_order_acquire)) +
                   1,
          .sample = counters.reader.samples.load(std::memory_order_acquire) + 1};
}

// Prepares the counters of a slot for a stream of another name, which begins with these numbers.
// Call while no thread uses the slot. What the RingShares compare with goes on.
inline void restart(StreamCounters& counters, const NextNumbers& first) noexcept {
  counters.reader.newest = first.frame - 1;
  counters.reader.frames = first.frame - 1;
  counters.reader.samples = first.sample - 1;
  counters.reader.newest_sample = first.sample - 1;
  counters.reader.dropped = 0;
  counters.reader.last_dropped = first.frame - 1;
  counters.reader.last_dropped_sample = first.sample - 1;
  counters.pipeline.consumed = first.frame - 1;
  counters.pipeline.last_out = first.frame - 1;
  counters.pipeline.shed = 0;
  counters.pipeline.dropped = 0;
  counters.pipeline.state = StreamState::kWaiting;
  for (ParameterCounter& parameter : counters.pipeline.parameter) {
    parameter.now = 0.0;
    parameter.target = 0.0;
  }
  for (ReadingCounter& reading : counters.pipeline.reading) reading.now = ReadingCounter::kUnknown;
}

// The part of a shared ring that one stream may fill, in items or in bytes. Because of it no stream
// can take the space of another. It belongs to the producer; `taken` is the consumer's count of
// what it has removed for this stream, or for those that had the stream's slot before it.
class RingShare {
 public:
  // Nothing of an earlier stream of the slot may be in the ring any more.
  RingShare(std::size_t size, const std::atomic<std::uint64_t>& taken) noexcept
      : size_(size), put_(taken.load(std::memory_order_acquire)), taken_(&taken) {}
  RT_SAFE [[nodiscard]] bool has_room(std::size_t amount = 1) const noexcept {
    return put_ - taken_->load(std::memory_order_acquire) + amount <= size_;
  }
  // Counts what was just put into the ring for this stream.
  RT_SAFE void add(std::size_t amount = 1) noexcept { put_ += amount; }

 private:
  std::uint64_t size_;
  std::uint64_t put_;
  const std::atomic<std::uint64_t>* taken_;
};

// Adds `n`. Only one thread may write the counter.
RT_SAFE inline void count(std::atomic<std::uint64_t>& counter, std::uint64_t n = 1) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + n, std::memory_order_relaxed);
}

}  // namespace posed::pipeline
