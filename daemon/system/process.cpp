#include "daemon/system/process.hpp"

#include <unistd.h>

#include <ctime>
#include <fstream>

#include "proto/frame/time.hpp"

namespace posed::system {

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t size = 0;
  std::uint64_t resident = 0;
  statm >> size >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::int64_t cpu_time_ns() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return std::int64_t{used.tv_sec} * kNanosPerSecond + used.tv_nsec;
}

}  // namespace posed::system
