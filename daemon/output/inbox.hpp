// Inbox: between the publisher's thread, which puts frames in, and the output's own thread, which
// takes them out. It is bounded: if the output is slow, the newest frames replace the oldest, which
// are counted. The publisher is a real-time thread: the lock is one that inherits its priority, it
// is held for copies of frames only, and nothing is freed and nobody woken under it.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/output/part.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/system/event_fd.hpp"
#include "daemon/system/priority_mutex.hpp"
#include "proto/frame/frame.hpp"

namespace posed::output {

// A stream that is there. Const; both threads share it.
struct PartStream {
  std::uint32_t id = 0;
  std::string name{};
  std::shared_ptr<const Skeleton> skeleton{};  // null: it has samples only
  drivers::SampleLayout samples{};
};
using PartStreams = std::array<std::shared_ptr<const PartStream>, kParts>;  // null: not there

// What was in an inbox at one moment.
class Delivery {
 public:
  static constexpr std::size_t kDepth = 16;  // frames

  Delivery() : frames_(kDepth) {}

  PartStreams streams{};
  std::optional<Sample> sample{};  // the newest of the body

  // Calls use(part, frame) for each frame, the oldest first.
  template <typename Use>
  void for_each(Use&& use) const {
    for (std::size_t i = 0; i < count_; ++i) {
      const Entry& entry = frames_[(first_ + i) % kDepth];
      use(entry.part, entry.frame);
    }
  }

 private:
  friend class Inbox;
  struct Entry {
    Part part{};
    Frame frame{};
  };
  // Returns whether the oldest frame was replaced.
  bool put(Part part, const Frame& frame) noexcept;
  void swap_frames(Delivery& other) noexcept;
  // Removes the frames of a part; returns how many there were.
  std::size_t remove(Part part) noexcept;

  std::vector<Entry> frames_;
  std::size_t first_ = 0, count_ = 0;
};

class Inbox {
 public:
  // `names`: the streams of the parts; empty: none. `wake` is notified of everything new and
  // outlives the inbox.
  Inbox(std::array<std::string, kParts> names, system::EventFd& wake)
      : names_(std::move(names)), wake_(wake) {}

  [[nodiscard]] bool wants(std::string_view stream) const noexcept;

  // The publisher's thread, as in publish::FrameOutput.
  void stream_comes(const publish::StreamInfo& stream);
  void frame(const Frame& frame) noexcept;
  void sample(const Sample& sample) noexcept;
  void stream_leaves(std::uint32_t stream) noexcept;

  // The output's thread: replaces `into` by what is there, and is empty afterwards.
  void receive(Delivery& into);

  // Any thread.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_.load(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(); }

 private:
  // The part whose stream is there with this id. Under mutex_.
  [[nodiscard]] std::optional<Part> part_of(std::uint32_t stream) const noexcept;

  std::array<std::string, kParts> names_;  // [part]
  system::EventFd& wake_;
  system::PriorityMutex mutex_;
  Delivery waiting_;  // under mutex_
  std::atomic<std::uint64_t> frames_{0}, dropped_{0};
};

}  // namespace posed::output
