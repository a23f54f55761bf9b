#include "daemon/system/thread_state.hpp"

#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

namespace posed::system {
namespace {

// proc_pid_stat(5): "TID (NAME) STATE ...", where NAME may have parentheses and spaces of its own.
bool waits(std::string_view stat, std::string_view name) {
  const auto open = stat.find('(');
  const auto close = stat.rfind(')');
  if (open == std::string_view::npos || close < open || close + 2 >= stat.size()) return false;
  return stat.substr(open + 1, close - open - 1) == name && stat[close + 2] == 'D';
}

}  // namespace

bool waits_for_disk(const std::string& thread) {
  const std::string name = thread.substr(0, 15);
  std::error_code gone;  // a thread may end while its folder is read
  for (std::filesystem::directory_iterator task("/proc/self/task", gone), end; !gone && task != end;
       task.increment(gone)) {
    std::ifstream file(task->path() / "stat");
    std::string stat;
    std::getline(file, stat);
    if (waits(stat, name)) return true;
  }
  return false;
}

}  // namespace posed::system
