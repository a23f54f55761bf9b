#include "daemon/service/service.hpp"

#include <cstdlib>
#include <utility>

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include "daemon/system/clock.hpp"
#include "daemon/system/thread_state.hpp"
#include "proto/frame/result.hpp"

namespace posed::service {
namespace {

// Between two looks a thread may sleep that long, and needs as long again on a busy machine.
constexpr std::int64_t kMinWatchdog_ns = 2 * Watchdog::kLooks * system::kMaxSleep_ns;

}  // namespace

Service::Service(std::vector<system::ThreadPulse> threads)
    : present_(std::getenv("NOTIFY_SOCKET") != nullptr) {
  std::uint64_t within_us = 0;
  if (!present_ || ::sd_watchdog_enabled(0, &within_us) <= 0) return;
  const auto within_ns = static_cast<std::int64_t>(within_us) * 1000;
  if (within_ns < kMinWatchdog_ns) {
    spdlog::warn("WatchdogSec is too short for signs of life in time; set it to {} s or more",
                 kMinWatchdog_ns / kNanosPerSecond);
  }
  watchdog_.emplace(std::move(threads), within_ns, system::waits_for_disk);
}

void Service::notify(const std::string& words) {
  if (!present_) return;
  if (const int sent = ::sd_notify(0, words.c_str()); sent < 0 && !std::exchange(warned_, true)) {
    spdlog::warn("systemd cannot be told of this daemon's state ({})", errno_text(-sent));
  }
}

void Service::ready() { notify("READY=1"); }

void Service::reloading() {
  notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(system::monotonic_ns() / 1000));
}

void Service::stopping() { notify("STOPPING=1\nSTATUS=ending"); }

void Service::status(const std::string& sentence) {
  if (sentence == status_) return;
  status_ = sentence;
  notify("STATUS=" + sentence);
}

void Service::turn(std::int64_t now_ns) {
  if (!watchdog_) return;
  const Watchdog::Finding found = watchdog_->look(now_ns);
  for (const std::string& thread : found.stuck) {
    spdlog::error(
        "the thread {} is stuck; systemd gets no more signs of life and will start posed again",
        thread);
  }
  for (const std::string& thread : found.waiting) {
    spdlog::warn("the thread {} waits for the disk; posed goes on, a new start would not help",
                 thread);
  }
  for (const std::string& thread : found.again) spdlog::warn("the thread {} goes on", thread);
  if (found.alive) notify("WATCHDOG=1");
}

}  // namespace posed::service
