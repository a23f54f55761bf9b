#include "daemon/assembly/output_threads.hpp"

#include <algorithm>
#include <utility>

#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"

namespace posed::assembly {
namespace {

std::string thread_name(const output::Output& output) { return "out-" + output.name(); }

}  // namespace

Result<std::unique_ptr<OutputThreads>> OutputThreads::open(
    const std::vector<config::OutputConfig>& configs) {
  auto threads = std::unique_ptr<OutputThreads>(new OutputThreads);
  for (const config::OutputConfig& config : configs) {
    auto output = TRY(output::open_output(config));
    auto poller = TRY(system::Poller::open());
    TRY(poller->add(output->wake()));
    if (output->poll_fd() >= 0) TRY(poller->add(output->poll_fd(), 0));
    threads->running_.push_back({.output = std::move(output),
                                 .poller = std::move(poller),
                                 .pulse = std::make_unique<system::Pulse>(),
                                 .thread = {}});
  }
  return threads;
}

std::vector<publish::FrameOutput*> OutputThreads::outputs() const {
  std::vector<publish::FrameOutput*> outputs(running_.size());
  std::ranges::transform(running_, outputs.begin(),
                         [](const Running& running) { return running.output.get(); });
  return outputs;
}

void OutputThreads::start(const output::Notify& notify) {
  for (Running& running : running_) {
    running.output->set_notify(notify);
    running.thread = std::thread([this, &running] { run(running); });
  }
}

void OutputThreads::run(Running& running) {
  output::Output& output = *running.output;
  system::name_thread(thread_name(output));
  while (true) {
    running.pulse->beat();
    output.wake().going_to_sleep();  // before the turn, so that what comes during it ends the wait
    const bool last = stop_.load(std::memory_order_acquire);
    const std::int64_t due_ns = output.turn(system::monotonic_ns());
    if (last) break;
    static_cast<void>(running.poller->wait(system::time_left_ns(due_ns, system::monotonic_ns)));
    output.wake().awake();
  }
}

std::vector<system::ThreadPulse> OutputThreads::pulses() const {
  std::vector<system::ThreadPulse> all;
  all.reserve(running_.size());
  for (const Running& running : running_) {
    all.push_back({.thread = thread_name(*running.output), .pulse = running.pulse.get()});
  }
  return all;
}

void OutputThreads::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  for (Running& running : running_) running.output->wake().notify();
  for (Running& running : running_) {
    if (running.thread.joinable()) running.thread.join();
  }
}

}  // namespace posed::assembly
