// What the kernel's scheduler counts of this process's threads (/proc/self/task/*/schedstat): how
// long each ran, how long it was ready and waited for a core, and how often it was put on one.
// Cold.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace posed::cli {

struct ThreadTimes {
  std::int64_t ran_ns = 0, waited_ns = 0;
  std::uint64_t turns = 0;
};

// By the threads' names; threads of one name are summed up. Empty where the kernel does not count.
using TimesByThread = std::map<std::string, ThreadTimes>;

[[nodiscard]] TimesByThread thread_times();

// Adds what passed from `before` to `after` to `sum`.
void add_passed(const TimesByThread& before, const TimesByThread& after, TimesByThread& sum);

}  // namespace posed::cli
