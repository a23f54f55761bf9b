// CPU time of this thread, so that other programs on the machine do not count.
#pragma once

#include <ctime>

namespace posed::bench {

inline double cpu_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

template <typename Work>
double timed_us(const Work& work) {
  const double start_us = cpu_us();
  work();
  return cpu_us() - start_us;
}

}  // namespace posed::bench
