// SharingRule: whether threads that hand every frame on to each other share one CPU (HotCpu),
// judged by what the kernel's scheduler counted of them. Cold; any thread, one at a time.
#pragma once

#include <cstdint>
#include <span>

#include "daemon/system/thread_time.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

// What one of the threads did since the last look.
struct ThreadShare {
  int priority = 0;
  ThreadTime time{};
};

// What all of the threads waited for others than themselves. A thread with a higher priority is the
// one that should run, so the time that it ran is no time lost.
[[nodiscard]] std::int64_t held_up_ns(std::span<const ThreadShare> threads) noexcept;

// What the threads did is a parameter, so tests can choose it. On several CPUs the same work takes
// more time, because each hand-over wakes one; so whether it fits one CPU is seen only by trying,
// more and more rarely while it does not.
class SharingRule {
 public:
  // More than one of these: from now on they use all CPUs.
  static constexpr double kFull = 0.8, kHeldUp = 0.1;
  static constexpr std::int64_t kFirstTry_ns = 10 * kNanosPerSecond;  // after so long apart
  static constexpr std::int64_t kRarest_ns = 64 * kFirstTry_ns;

  // Since the last look, in shares of that time: what the threads together have run, and for how
  // long others held them up.
  struct Seen {
    double load = 0.0;
    double held_up = 0.0;
  };
  [[nodiscard]] bool share(const Seen& seen, std::int64_t now_ns) noexcept;

 private:
  bool shared_ = true;
  std::int64_t since_ns_ = kNoTime_ns;  // of sharing or not
  std::int64_t try_after_ns_ = kFirstTry_ns / 2;
};

}  // namespace posed::system
