// Processor time of the calling thread, so that a busy machine changes a figure little.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <numeric>
#include <string>
#include <vector>

namespace posed::test {

inline double processor_time_us() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
}

template <typename Work>
double timed_us(const Work& work) {
  const double start_us = processor_time_us();
  work();
  return processor_time_us() - start_us;
}

// "1000 frames: mean 1.0, p50 1.0, p99 2.0, p99.9 3.0, max 4 us"; at least one time.
inline std::string time_figures(std::vector<double> us) {
  std::ranges::sort(us);
  const auto at = [&](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  const double mean_us =
      std::accumulate(us.begin(), us.end(), 0.0) / static_cast<double>(us.size());
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "%zu frames: mean %.1f, p50 %.1f, p99 %.1f, p99.9 %.1f, max %.0f us", us.size(),
                mean_us, at(0.5), at(0.99), at(0.999), us.back());
  return text.data();
}

}  // namespace posed::test
