#include "daemon/system/realtime.hpp"

#include <pthread.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>

namespace posed::system {
namespace {

bool become_fifo(int priority) {
  const sched_param wanted{.sched_priority = priority};
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) == 0;
}

// Tries SCHED_FIFO on the calling thread, then restores the thread's scheduling.
bool may_be_fifo() {
  if (!become_fifo(kReaderPriority)) return false;
  const sched_param ordinary{.sched_priority = 0};
  return pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary) == 0;
}

}  // namespace

bool ask_for_realtime() {
  const bool locked = mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
  const bool fifo = may_be_fifo();
  if (!locked || !fifo) {
    spdlog::warn(
        "no real-time rights ({}): frames may be late when the machine is busy; `posed doctor` "
        "says what to grant, or set realtime = false",
        fifo     ? "memory cannot be locked"
        : locked ? "SCHED_FIFO is refused"
                 : "SCHED_FIFO is refused, memory cannot be locked");
  }
  return fifo;
}

void name_thread(const std::string& name) {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
}

void give_way() {
  constexpr int kLowest = 19;
  static_cast<void>(setpriority(PRIO_PROCESS, 0, kLowest));  // on Linux: of this thread alone
}

void enter_hot_thread(const char* name, int priority) {
  name_thread(name);
  prctl(PR_SET_TIMERSLACK, 1UL);  // waits end on time instead of up to 50 us late
  if (priority > 0) static_cast<void>(become_fifo(priority));
}

}  // namespace posed::system
