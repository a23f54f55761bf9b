#include "daemon/system/process.hpp"

#include <unistd.h>

#include <ctime>
#include <fstream>
#include <sstream>
#include <string>

#include "proto/frame/time.hpp"

namespace posed::system {

namespace {

std::int64_t now_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNanosPerSecond + now.tv_nsec;
}

}  // namespace

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t size = 0;
  std::uint64_t resident = 0;
  statm >> size >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::int64_t cpu_time_ns() { return now_ns(CLOCK_PROCESS_CPUTIME_ID); }

double start_time_s() {
  // Of /proc/self/stat: the name in brackets may contain anything, and 19 words behind it comes the
  // start in ticks since the boot.
  std::string line;
  std::getline(std::ifstream("/proc/self/stat"), line);
  std::istringstream words(line.substr(line.rfind(')') + 1));
  std::string word;
  for (int i = 0; i < 19; ++i) words >> word;
  double ticks = 0.0;
  if (!(words >> ticks)) return 0.0;
  const double age_s =
      seconds(now_ns(CLOCK_BOOTTIME)) - ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
  return seconds(now_ns(CLOCK_REALTIME)) - age_s;
}

}  // namespace posed::system
