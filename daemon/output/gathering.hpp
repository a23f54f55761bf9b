// Gathering: decides when the poses of several streams go out as one. Those of one source come one
// right after the other: they wait for each other, but not for a stream that is silent, and no
// longer than a moment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/frame/time.hpp"

namespace posed::output {

// One thread.
class Gathering {
 public:
  static constexpr std::int64_t kMoment_ns = 2'000'000;

  explicit Gathering(std::size_t streams) : streams_(streams) {}

  void leaves(std::size_t stream) noexcept { streams_[stream] = {}; }

  // A pose has come. Returns whether all that are due have: then the next ones are gathered.
  [[nodiscard]] bool comes(std::size_t stream, std::int64_t now_ns) noexcept {
    if (is_late(now_ns)) sent();  // what has waited for too long goes with the next
    const bool again = streams_[stream].waits;
    streams_[stream] = {.waits = true, .came_ns = now_ns};
    if (due_ns_ == kNoTime_ns) due_ns_ = now_ns + kMoment_ns;
    if (!again && missing(now_ns)) return false;
    sent();
    return true;
  }

  // When what has come is to be sent without the rest; kNoTime_ns: nothing waits.
  [[nodiscard]] std::int64_t due_ns() const noexcept { return due_ns_; }
  [[nodiscard]] bool is_late(std::int64_t now_ns) const noexcept {
    return due_ns_ != kNoTime_ns && now_ns >= due_ns_;
  }
  void sent() noexcept {
    due_ns_ = kNoTime_ns;
    for (Stream& stream : streams_) stream.waits = false;
  }

 private:
  static constexpr std::int64_t kSilent_ns = kNanosPerSecond / 4;
  struct Stream {
    bool waits = false;
    std::int64_t came_ns = kNoTime_ns;
  };
  [[nodiscard]] bool missing(std::int64_t now_ns) const noexcept {
    for (const Stream& stream : streams_) {
      const bool live = stream.came_ns != kNoTime_ns && now_ns - stream.came_ns < kSilent_ns;
      if (live && !stream.waits) return true;
    }
    return false;
  }

  std::vector<Stream> streams_;
  std::int64_t due_ns_ = kNoTime_ns;
};

}  // namespace posed::output
