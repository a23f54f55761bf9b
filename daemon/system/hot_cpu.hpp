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

#include "daemon/system/thread_time.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

// Returns the CPU among `allowed` that has the highest capacity; if several have it the last one,
// because the first handles interrupts. Empty if fewer than two are allowed. `sys` is the folder
// /sys.
[[nodiscard]] std::optional<int> quickest_cpu(const cpu_set_t& allowed, const std::string& sys);

// The times of one thread since the last look.
struct ThreadShare {
  int priority = 0;
  ThreadTime time{};
};

// Returns how long the threads waited for threads that are not among them. A thread of higher
// priority should run first, so the time that it ran does not count.
[[nodiscard]] std::int64_t held_up_ns(std::span<const ThreadShare> threads) noexcept;

// Decides whether threads that hand every frame on to each other share one CPU (HotCpu), by the
// times that the kernel's scheduler counted for them. Cold; any thread, one at a time. The times
// are a parameter, so tests can choose them. On several CPUs the same work takes more time, because
// each hand-over wakes one; so whether it fits one CPU is seen only by trying, more and more rarely
// while it does not.
class SharingRule {
 public:
  // Above either threshold the threads stop sharing a CPU.
  static constexpr double kFull = 0.8, kHeldUp = 0.1;
  static constexpr std::int64_t kFirstTry_ns = 10 * kNanosPerSecond;  // they share again after this
  static constexpr std::int64_t kRarest_ns = 64 * kFirstTry_ns;

  // Both are shares of the time since the last look: how long the threads ran together, and how
  // long other threads held them up.
  struct Seen {
    double load = 0.0;
    double held_up = 0.0;
  };
  [[nodiscard]] bool share(const Seen& seen, std::int64_t now_ns) noexcept;

 private:
  bool shared_ = true;
  std::int64_t since_ns_ = kNoTime_ns;  // when they began to share, or stopped
  std::int64_t try_after_ns_ = kFirstTry_ns / 2;
};

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
