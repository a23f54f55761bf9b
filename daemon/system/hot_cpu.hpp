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

#include <pthread.h>
#include <sched.h>

#include "proto/frame/time.hpp"

namespace posed::system {

// Whether the threads share a CPU. The load is a parameter, so tests can choose it. On several CPUs
// the same work takes more time, because each hand-over wakes one; so whether it fits one CPU is
// seen only by trying, more and more rarely while it does not.
class SharingRule {
 public:
  static constexpr double kFull = 0.8;  // more than this of the CPU: from now on they use all
  static constexpr std::int64_t kFirstTry_ns = 10 * kNanosPerSecond;  // after so long apart
  static constexpr std::int64_t kRarest_ns = 64 * kFirstTry_ns;

  // `load`: what the threads together have run since the last look, in shares of one CPU.
  [[nodiscard]] bool share(double load, std::int64_t now_ns) noexcept;

 private:
  bool shared_ = true;
  std::int64_t since_ns_ = kNoTime_ns;  // of sharing or not
  std::int64_t try_after_ns_ = kFirstTry_ns / 2;
};

// Of the CPUs `allowed` the one with the highest capacity; of several the last, because the first
// handles interrupts. Empty if there are not two. `sys`: the folder /sys.
[[nodiscard]] std::optional<int> quickest_cpu(const cpu_set_t& allowed, const std::string& sys);

class HotCpu {
 public:
  // One of those that the calling thread may use; null if there are not two.
  [[nodiscard]] static std::unique_ptr<HotCpu> open();
  ~HotCpu();
  HotCpu(const HotCpu&) = delete;
  HotCpu& operator=(const HotCpu&) = delete;

  // The thread becomes one of those that share the CPU. It must not be joined before this object
  // ends.
  void add(pthread_t thread);

 private:
  HotCpu(const cpu_set_t& allowed, int cpu);
  void watch();
  void move(const cpu_set_t& where);
  [[nodiscard]] std::int64_t run_ns() const;

  const cpu_set_t allowed_;
  const int cpu_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool end_ = false;
  bool shared_ = true;
  std::vector<pthread_t> members_;
  std::thread thread_;
};

}  // namespace posed::system
