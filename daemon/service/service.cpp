#include "daemon/service/service.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include "daemon/system/clock.hpp"
#include "proto/frame/result.hpp"

namespace posed::service {
namespace {

// Between two looks a thread may sleep that long, and needs as long again on a busy machine.
constexpr std::int64_t kMinWatchdog_ns = 2 * Watchdog::kLooks * system::kMaxSleep_ns;
constexpr std::uint64_t kMaxWatchdog_us = 31'536'000'000'000;  // a year: longer is as good as never

// proc_pid_stat(5): "TID (NAME) STATE ...", where NAME may have parentheses and spaces of its own.
bool waits(std::string_view stat, std::string_view name) {
  const auto open = stat.find('(');
  const auto close = stat.rfind(')');
  if (open == std::string_view::npos || close < open || close + 2 >= stat.size()) return false;
  return stat.substr(open + 1, close - open - 1) == name && stat[close + 2] == 'D';
}

}  // namespace

Watchdog::Watchdog(std::vector<system::ThreadPulse> threads, std::int64_t within_ns,
                   WaitsForDisk waits_for_disk)
    : every_ns_(within_ns / kLooks), waits_for_disk_(std::move(waits_for_disk)) {
  for (system::ThreadPulse& thread : threads) {
    const std::uint64_t beats = thread.pulse->beats();
    watched_.push_back({.thread = std::move(thread), .seen = beats});
  }
}

Watchdog::State Watchdog::state_of(Watched& watched) const {
  const std::uint64_t beats = watched.thread.pulse->beats();
  if (std::exchange(watched.seen, beats) != beats) return State::kGoesOn;
  return waits_for_disk_(watched.thread.thread) ? State::kWaits : State::kStuck;
}

// The first call only begins the time.
Watchdog::Finding Watchdog::look(std::int64_t now_ns) {
  if (looked_ns_ == kNoTime_ns) looked_ns_ = now_ns;
  if (now_ns - looked_ns_ < every_ns_) return {};
  looked_ns_ = now_ns;
  Finding finding{.alive = true, .stuck = {}, .waiting = {}, .again = {}};
  for (Watched& watched : watched_) {
    const State state = state_of(watched);
    if (state == State::kStuck) finding.alive = false;
    if (std::exchange(watched.state, state) == state) continue;
    auto& changed = state == State::kStuck   ? finding.stuck
                    : state == State::kWaits ? finding.waiting
                                             : finding.again;
    changed.push_back(watched.thread.thread);
  }
  return finding;
}

Service::Service(std::vector<system::ThreadPulse> threads)
    : present_(std::getenv("NOTIFY_SOCKET") != nullptr) {
  std::uint64_t within_us = 0;
  const int asked = present_ ? ::sd_watchdog_enabled(0, &within_us) : 0;
  if (asked < 0) {
    spdlog::warn(
        "WATCHDOG_USEC or WATCHDOG_PID makes no sense ({}), so nobody is told when posed is stuck;"
        " leave setting them to systemd",
        errno_text(-asked));
  }
  if (asked <= 0) return;
  const auto within_ns = static_cast<std::int64_t>(std::min(within_us, kMaxWatchdog_us)) * 1000;
  if (within_ns < kMinWatchdog_ns) {
    spdlog::warn("WatchdogSec is too short for signs of life in time; set it to {} s or more",
                 kMinWatchdog_ns / kNanosPerSecond);
  }
  watchdog_.emplace(std::move(threads), within_ns, waits_for_disk);
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

bool waits_for_disk(const std::string& thread) {
  const std::string name = thread.substr(0, 15);
  std::error_code gone;  // a thread may end while its folder is read
  for (std::filesystem::directory_iterator task("/proc/self/task", gone), end; !gone && task != end;
       task.increment(gone)) {
    std::ifstream file(task->path() / "stat");
    std::string stat;
    std::getline(file, stat);
    if (waits(stat, name)) return true;
  }
  return false;
}

}  // namespace posed::service
