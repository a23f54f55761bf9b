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
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/types.h>

#include "proto/frame/time.hpp"

namespace posed::system {

// Whether the threads share a CPU. What they did is a parameter, so tests can choose it. On several
// CPUs the same work takes more time, because each hand-over wakes one; so whether it fits one CPU
// is seen only by trying, more and more rarely while it does not.
class SharingRule {
 public:
  // More than one of these: from now on they use all CPUs.
  static constexpr double kFull = 0.8, kHeldUp = 0.1;
  static constexpr std::int64_t kFirstTry_ns = 10 * kNanosPerSecond;  // after so long apart
  static constexpr std::int64_t kRarest_ns = 64 * kFirstTry_ns;

  // Since the last look, in shares of that time: what the threads together have run, and for how
  // long others held them up.
  struct Seen {
    double load = 0.0;
    double held_up = 0.0;
  };
  [[nodiscard]] bool share(const Seen& seen, std::int64_t now_ns) noexcept;

 private:
  bool shared_ = true;
  std::int64_t since_ns_ = kNoTime_ns;  // of sharing or not
  std::int64_t try_after_ns_ = kFirstTry_ns / 2;
};

// How long a thread ran, and how long it was ready to run while others had the CPU.
struct ThreadTime {
  int priority = 0;
  std::int64_t run_ns = 0, wait_ns = 0;
};

// What all of the threads waited for others than themselves. A thread with a higher priority is the
// one that should run, so the time that it ran is no time lost.
[[nodiscard]] std::int64_t held_up_ns(std::span<const ThreadTime> threads) noexcept;

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
