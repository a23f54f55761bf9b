#include "daemon/system/process.hpp"

#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

#include "daemon/system/clock.hpp"

namespace posed::system {

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t size = 0;
  std::uint64_t resident = 0;
  statm >> size >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::int64_t cpu_time_ns() { return clock_ns(CLOCK_PROCESS_CPUTIME_ID); }

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
      seconds(clock_ns(CLOCK_BOOTTIME)) - ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
  return seconds(clock_ns(CLOCK_REALTIME)) - age_s;
}

}  // namespace posed::system
