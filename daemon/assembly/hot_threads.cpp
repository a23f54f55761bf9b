#include "daemon/assembly/hot_threads.hpp"

#include <utility>

#include "daemon/system/realtime.hpp"

namespace posed::assembly {

HotThreads::HotThreads(bool realtime, bool share_cpu)
    : realtime_(realtime && system::ask_for_realtime()) {
  if (realtime_ && share_cpu) cpu_ = system::HotCpu::open();
}

std::thread HotThreads::start(const char* name, int priority, std::function<void()> run) {
  return std::thread([cpu = cpu_, name, priority = realtime_ ? priority : 0, run = std::move(run)] {
    system::enter_hot_thread(name, priority);
    if (cpu) cpu->join(priority);
    run();
  });
}

}  // namespace posed::assembly
