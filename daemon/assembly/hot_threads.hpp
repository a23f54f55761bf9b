// HotThreads: how the reader, the pipeline and the publisher run: with real-time rights if these
// are wanted and granted, and then on one CPU while it has room for them (system/hot_cpu.hpp).
// Cold.
#pragma once

#include <functional>
#include <memory>
#include <thread>

#include "daemon/system/hot_cpu.hpp"

namespace posed::assembly {

class HotThreads {
 public:
  // Asks the operating system for what is wanted; a refusal is only a warning.
  HotThreads(bool realtime, bool share_cpu);

  // Runs `run` in a thread of that name and, with real-time rights, of that priority.
  [[nodiscard]] std::thread start(const char* name, int priority, std::function<void()> run);
  // Before the first of these threads ends.
  void ending() {
    if (cpu_) cpu_->stop();
  }

 private:
  bool realtime_;
  std::shared_ptr<system::HotCpu> cpu_;  // null: not wanted, or not possible
};

}  // namespace posed::assembly
