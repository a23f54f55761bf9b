#include "daemon/system/priority_mutex.hpp"

#include <catch2/catch.hpp>

#include <sched.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <iterator>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace posed::system {
namespace {

// At which the kernel runs the calling thread now; below 0: as a real-time one (man 5 proc).
int own_priority() {
  std::ifstream file("/proc/self/task/" + std::to_string(::gettid()) + "/stat");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  std::istringstream words(text.substr(text.rfind(')') + 1));
  const std::vector<std::string> fields{std::istream_iterator<std::string>(words), {}};
  return std::stoi(fields.at(15));
}

}  // namespace

TEST_CASE("the holder of a priority mutex runs at the priority of the thread that waits for it") {
  PriorityMutex mutex;
  std::atomic<bool> refused{false};
  std::thread urgent;
  {
    const std::scoped_lock lock(mutex);
    CHECK(own_priority() >= 0);
    urgent = std::thread([&] {
      const sched_param param{.sched_priority = 1};
      refused = ::sched_setscheduler(0, SCHED_FIFO, &param) != 0;
      const std::scoped_lock waiting(mutex);
    });
    for (int i = 0; i < 5000 && !refused && own_priority() >= 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (refused) {
      WARN("SKIPPED: this user may not use SCHED_FIFO");
    } else {
      CHECK(own_priority() < 0);
    }
  }
  urgent.join();
  CHECK(own_priority() >= 0);
}

}  // namespace posed::system
