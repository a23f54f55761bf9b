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

// Of the CPUs `allowed` the one with the highest capacity; of several the last, because the first
// handles interrupts. Empty if there are not two. `sys`: the folder /sys.
[[nodiscard]] std::optional<int> quickest_cpu(const cpu_set_t& allowed, const std::string& sys);

class HotCpu {
 public:
  // One of those that the calling thread may use; null if there are not two, or if the kernel does
  // not tell what threads run.
  [[nodiscard]] static std::unique_ptr<HotCpu> open();
  ~HotCpu();
  HotCpu(const HotCpu&) = delete;
  HotCpu& operator=(const HotCpu&) = delete;

  // The calling thread, of this priority, becomes one of those that share the CPU.
  void join(int priority);
  // From now on they stay where they are. Before the first of them ends.
  void stop();

 private:
  HotCpu(const cpu_set_t& allowed, int cpu);
  struct Member {
    pid_t thread = 0;
    int priority = 0;
    ThreadTime time{};  // at the last look
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
