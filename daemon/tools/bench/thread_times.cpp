#include "daemon/tools/bench/thread_times.hpp"

#include <filesystem>
#include <fstream>
#include <system_error>

namespace posed::tools {

TimesByThread thread_times() {
  TimesByThread times;
  std::error_code ignored;  // a thread may end meanwhile
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
    std::string name;
    const auto time = system::time_of_thread(std::stoi(task.path().filename()));
    if (time && std::getline(std::ifstream(task.path() / "comm"), name)) times[name] += *time;
  }
  return times;
}

void add_passed(const TimesByThread& before, const TimesByThread& after, TimesByThread& sum) {
  for (const auto& [name, now] : after) {
    const auto found = before.find(name);
    sum[name] += now - (found == before.end() ? system::ThreadTime{} : found->second);
  }
}

}  // namespace posed::tools
