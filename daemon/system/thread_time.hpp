// The times that the kernel's scheduler counts for a thread of this process
// (/proc/self/task/TID/schedstat). Cold.
#pragma once

#include <cstdint>
#include <optional>

#include <sys/types.h>

namespace posed::system {

struct ThreadTime {
  std::int64_t ran_ns = 0;
  std::int64_t waited_ns = 0;  // it was ready to run while others had the CPU
  std::int64_t turns = 0;      // how often it was put on a CPU

  ThreadTime& operator+=(const ThreadTime& other) noexcept;
};

[[nodiscard]] ThreadTime operator-(const ThreadTime& later, const ThreadTime& earlier) noexcept;

// Returns the times since the thread began; empty if it has ended, or if the kernel does not count.
[[nodiscard]] std::optional<ThreadTime> time_of_thread(pid_t thread);

}  // namespace posed::system
