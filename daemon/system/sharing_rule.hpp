// SharingRule: decides whether threads that hand every frame on to each other share one CPU
// (HotCpu), by the times that the kernel's scheduler counted for them. Cold; any thread, one at a
// time.
#pragma once

#include <cstdint>
#include <span>

#include "daemon/system/thread_time.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

// The times of one thread since the last look.
struct ThreadShare {
  int priority = 0;
  ThreadTime time{};
};

// Returns how long the threads waited for threads that are not among them. A thread of higher
// priority should run first, so the time that it ran does not count.
[[nodiscard]] std::int64_t held_up_ns(std::span<const ThreadShare> threads) noexcept;

// The times are a parameter, so tests can choose them. On several CPUs the same work takes
// more time, because each hand-over wakes one; so whether it fits one CPU is seen only by trying,
// more and more rarely while it does not.
class SharingRule {
 public:
  // Above either threshold the threads stop sharing a CPU.
  static constexpr double kFull = 0.8, kHeldUp = 0.1;
  static constexpr std::int64_t kFirstTry_ns = 10 * kNanosPerSecond;  // they share again after this
  static constexpr std::int64_t kRarest_ns = 64 * kFirstTry_ns;

  // Both are shares of the time since the last look: how long the threads ran together, and how
  // long other threads held them up.
  struct Seen {
    double load = 0.0;
    double held_up = 0.0;
  };
  [[nodiscard]] bool share(const Seen& seen, std::int64_t now_ns) noexcept;

 private:
  bool shared_ = true;
  std::int64_t since_ns_ = kNoTime_ns;  // when they began to share, or stopped
  std::int64_t try_after_ns_ = kFirstTry_ns / 2;
};

}  // namespace posed::system
