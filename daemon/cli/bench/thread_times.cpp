#include "daemon/cli/bench/thread_times.hpp"

#include <filesystem>
#include <fstream>
#include <system_error>

namespace posed::cli {

TimesByThread thread_times() {
  TimesByThread times;
  std::error_code ignored;  // a thread may end meanwhile
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
    std::string name;
    ThreadTimes one;
    std::ifstream statistics(task.path() / "schedstat");
    if (!std::getline(std::ifstream(task.path() / "comm"), name) ||
        !(statistics >> one.ran_ns >> one.waited_ns >> one.turns)) {
      continue;
    }
    ThreadTimes& sum = times[name];
    sum.ran_ns += one.ran_ns;
    sum.waited_ns += one.waited_ns;
    sum.turns += one.turns;
  }
  return times;
}

void add_passed(const TimesByThread& before, const TimesByThread& after, TimesByThread& sum) {
  for (const auto& [name, now] : after) {
    const auto found = before.find(name);
    const ThreadTimes then = found == before.end() ? ThreadTimes{} : found->second;
    ThreadTimes& all = sum[name];
    all.ran_ns += now.ran_ns - then.ran_ns;
    all.waited_ns += now.waited_ns - then.waited_ns;
    all.turns += now.turns - then.turns;
  }
}

}  // namespace posed::cli
