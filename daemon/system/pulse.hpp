// Pulse: shows that a thread makes progress. Each of the daemon's threads beats in every turn of
// its loop, and none sleeps longer than kMaxSleep_ns; so one that does not beat is stuck.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

inline constexpr std::int64_t kMaxSleep_ns = kNanosPerSecond / 4;

class Pulse {
 public:
  // Only the watched thread itself calls it.
  RT_SAFE void beat() noexcept {
    beats_.store(beats_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  // Counts the calls of beat(). Any thread.
  [[nodiscard]] std::uint64_t beats() const noexcept {
    return beats_.load(std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t> beats_{0};
};

// A thread that is watched. The pulse outlives the watching.
struct ThreadPulse {
  std::string thread;  // the thread's name
  const Pulse* pulse;
};

}  // namespace posed::system
