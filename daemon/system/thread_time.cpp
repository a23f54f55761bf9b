#include "daemon/system/thread_time.hpp"

#include <fstream>
#include <string>

namespace posed::system {

ThreadTime& ThreadTime::operator+=(const ThreadTime& other) noexcept {
  ran_ns += other.ran_ns;
  waited_ns += other.waited_ns;
  turns += other.turns;
  return *this;
}

ThreadTime operator-(const ThreadTime& later, const ThreadTime& earlier) noexcept {
  return {.ran_ns = later.ran_ns - earlier.ran_ns,
          .waited_ns = later.waited_ns - earlier.waited_ns,
          .turns = later.turns - earlier.turns};
}

// Three numbers, as the kernel's scheduler/sched-stats.rst has them; zeros where it does not count.
std::optional<ThreadTime> time_of_thread(pid_t thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/schedstat");
  ThreadTime time;
  if (!(file >> time.ran_ns >> time.waited_ns >> time.turns) || time.turns == 0) {
    return std::nullopt;
  }
  return time;
}

}  // namespace posed::system
