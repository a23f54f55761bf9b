// Inbox: a bounded queue between the publisher's thread, which puts frames in, and the output's own
// thread, which drains it. If the output is slow, the newest frames replace the oldest, which are
// counted. The publisher is a real-time thread: the lock inherits its priority and is held only
// while frames are copied; nothing is freed and no thread is woken under it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/publish/publisher.hpp"
#include "daemon/system/event_fd.hpp"
#include "daemon/system/priority_mutex.hpp"
#include "proto/frame/frame.hpp"

namespace posed::output {

// A live stream. It is constant, and both threads share it.
struct LiveStream {
  std::uint32_t id = 0;
  std::string name{};
  std::shared_ptr<const Skeleton> skeleton{};  // null if it has samples only
  drivers::SampleLayout samples{};
  double rate_hz = 0.0;     // expected frame rate; 0: unknown
  std::int32_t number = 0;  // drivers::Body::number
};
// [place], in the order in which the output names its streams; null: absent.
using LiveStreams = std::vector<std::shared_ptr<const LiveStream>>;

// The content of an inbox at one moment.
class Delivery {
 public:
  static constexpr std::size_t kDepth = 16;  // frames of a stream

  explicit Delivery(std::size_t places) : streams(places), samples(places), queues_(places) {}

  LiveStreams streams;
  std::vector<std::optional<Sample>> samples;  // [place] the newest

  // Calls use(place, frame) for each frame, the oldest first.
  template <typename Use>
  void for_each(Use&& use) const {
    std::vector<std::size_t> used(queues_.size(), 0);
    while (const auto place = oldest(used)) {
      use(*place, queues_[*place].at(used[*place]).frame);
      ++used[*place];
    }
  }

 private:
  friend class Inbox;
  struct Entry {
    std::uint64_t number = 0;  // of the frames of all streams, in their order
    Frame frame{};
  };
  // The newest frames of one stream, so that none costs another its own.
  struct Queue {
    std::vector<Entry> entries = std::vector<Entry>(kDepth);
    std::size_t first = 0, count = 0;

    [[nodiscard]] const Entry& at(std::size_t i) const noexcept {
      return entries[(first + i) % kDepth];
    }
  };
  // Returns whether the stream's oldest frame was replaced.
  bool put(std::size_t place, const Frame& frame) noexcept;
  void clear() noexcept;
  void swap_frames(Delivery& other) noexcept;
  // Removes the frames of a stream; returns how many there were.
  std::size_t remove(std::size_t place) noexcept;
  // The place of the oldest frame, where the first `used` [place] ones do not count.
  [[nodiscard]] std::optional<std::size_t> oldest(
      const std::vector<std::size_t>& used) const noexcept;

  std::vector<Queue> queues_;  // [place]
  std::uint64_t number_ = 0;
};

class Inbox {
 public:
  // `names` are the wanted streams; an empty name means none. `wake` is notified of everything new
  // and outlives the inbox.
  Inbox(std::vector<std::string> names, system::EventFd& wake)
      : names_(std::move(names)), wake_(wake), waiting_(names_.size()) {}

  [[nodiscard]] bool wants(std::string_view stream) const noexcept;

  // The publisher's thread calls these, as described in publish::FrameOutput.
  void stream_comes(const publish::StreamInfo& stream);
  void frame(const Frame& frame) noexcept;
  void sample(const Sample& sample) noexcept;
  void stream_leaves(std::uint32_t stream) noexcept;

  // The output's thread calls it. It moves everything into `into`, whose old content is lost.
  void drain(Delivery& into);

  // Any thread.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_.load(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(); }

 private:
  // Returns the place whose live stream has this id. Call it with mutex_ held.
  [[nodiscard]] std::optional<std::size_t> place_of(std::uint32_t stream) const noexcept;

  std::vector<std::string> names_;  // [place]
  system::EventFd& wake_;
  system::PriorityMutex mutex_;
  Delivery waiting_;  // under mutex_
  std::atomic<std::uint64_t> frames_{0}, dropped_{0};
};

}  // namespace posed::output
