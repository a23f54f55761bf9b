// The time of all threads of this process, by name, for `posed bench`. Cold.
#pragma once

#include <map>
#include <string>

#include "daemon/system/thread_time.hpp"

namespace posed::tools {

// By the threads' names; threads of one name are summed up. Empty where the kernel does not count.
using TimesByThread = std::map<std::string, system::ThreadTime>;

[[nodiscard]] TimesByThread thread_times();

// Adds what passed from `before` to `after` to `sum`.
void add_passed(const TimesByThread& before, const TimesByThread& after, TimesByThread& sum);

}  // namespace posed::tools
