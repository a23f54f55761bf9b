// OutputThreads: the outputs of a config, each with a thread of its own. Cold.
#pragma once

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/output/output.hpp"
#include "daemon/publish/frame_output.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/frame/result.hpp"

namespace posed::assembly {

class OutputThreads {
 public:
  // Opens their sockets; nothing runs yet.
  static Result<std::unique_ptr<OutputThreads>> open(
      const std::vector<config::OutputConfig>& configs);
  ~OutputThreads() { stop(); }
  OutputThreads(const OutputThreads&) = delete;
  OutputThreads& operator=(const OutputThreads&) = delete;

  // For the publisher; valid until the destructor.
  [[nodiscard]] std::vector<publish::FrameOutput*> outputs() const;

  // Call once. `notify` is called by the threads.
  void start(const output::Notify& notify);
  // What was handed over before is still sent. May be called again.
  void stop() noexcept;
  // Of all threads; valid until the destructor.
  [[nodiscard]] std::vector<system::ThreadPulse> pulses() const;

 private:
  struct Running {
    std::unique_ptr<output::Output> output;
    std::unique_ptr<system::Poller> poller;
    std::unique_ptr<system::Pulse> pulse;
    std::thread thread;
  };
  OutputThreads() = default;
  void run(Running& running);

  std::vector<Running> running_;
  std::atomic<bool> stop_{false};
};

}  // namespace posed::assembly
