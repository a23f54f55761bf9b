#include "daemon/tools/command/waiting.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

namespace posed::tools {

using std::chrono::seconds;

Waiting::Waiting(std::string what)
    : what_(std::move(what)),
      terminal_(isatty(STDERR_FILENO) == 1),
      thread_([this](const std::stop_token& stop) { show(stop); }) {}

Waiting::~Waiting() {
  thread_.request_stop();
  thread_.join();
}

void Waiting::show(const std::stop_token& stop) {
  const auto never = [] { return false; };
  std::unique_lock lock(mutex_);
  seconds passed{0};
  bool drawn = false;
  while (true) {
    // In a log file a line a second is too much: print after 1, 2, 4, ... seconds.
    const seconds step = terminal_ ? seconds(1) : std::max(seconds(1), passed);
    ended_.wait_for(lock, stop, step, never);
    if (stop.stop_requested()) break;
    passed += step;
    std::fprintf(stderr, terminal_ ? "\r\033[K%s ... %lld s" : "%s ... %lld s\n", what_.c_str(),
                 static_cast<long long>(passed.count()));
    drawn = true;
  }
  if (terminal_ && drawn) std::fprintf(stderr, "\r\033[K");
}

}  // namespace posed::tools
