// HotCpu: threads that hand every frame on to each other share one CPU while it has room for all of
// them. A hand-over is then a switch on that CPU; otherwise it wakes an idle one, which may take
// longer than all stages of a frame (daemon/HOP.md). Only for threads under SCHED_FIFO: any other
// would wait behind whatever else runs on that CPU. A thread of its own looks at how much of the
// CPU they use. Cold.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/types.h>

#include "daemon/system/sharing_rule.hpp"
#include "daemon/system/thread_time.hpp"

namespace posed::system {

// Returns the CPU among `allowed` that has the highest capacity; if several have it the last one,
// because the first handles interrupts. Empty if fewer than two are allowed. `sys` is the folder
// /sys.
[[nodiscard]] std::optional<int> quickest_cpu(const cpu_set_t& allowed, const std::string& sys);

class HotCpu {
 public:
  // Chooses among the CPUs that the calling thread may use; null if it may use only one, or if the
  // kernel does not count how long threads run.
  [[nodiscard]] static std::unique_ptr<HotCpu> open();
  ~HotCpu();
  HotCpu(const HotCpu&) = delete;
  HotCpu& operator=(const HotCpu&) = delete;

  // Adds the calling thread, which has this priority, to the threads that share the CPU.
  void join(int priority);
  // Leaves the threads where they are from now on. Call it before the first of them ends.
  void stop();

 private:
  HotCpu(const cpu_set_t& allowed, int cpu);
  struct Member {
    pid_t thread = 0;
    int priority = 0;
    ThreadTime time{};  // its value at the last look
  };
  void watch();
  void look(std::int64_t passed_ns, std::int64_t now_ns);
  void move(const cpu_set_t& where);

  const cpu_set_t allowed_;
  const int cpu_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool end_ = false;
  SharingRule rule_;
  bool shared_ = true;
  std::vector<Member> members_;
  std::thread thread_;
};

}  // namespace posed::system
