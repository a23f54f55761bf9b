#include "daemon/service/watchdog.hpp"

#include <utility>

namespace posed::service {

Watchdog::Watchdog(std::vector<system::ThreadPulse> threads, std::int64_t within_ns)
    : every_ns_(within_ns / 2) {
  for (system::ThreadPulse& thread : threads) {
    const std::uint64_t beats = thread.pulse->beats();
    watched_.push_back({.thread = std::move(thread), .seen = beats});
  }
}

// The first call only begins the time.
Watchdog::Finding Watchdog::look(std::int64_t now_ns) {
  if (looked_ns_ == kNoTime_ns) looked_ns_ = now_ns;
  if (now_ns - looked_ns_ < every_ns_) return {};
  looked_ns_ = now_ns;
  Finding finding{.alive = true, .stuck = {}, .again = {}};
  for (Watched& watched : watched_) {
    const std::uint64_t beats = watched.thread.pulse->beats();
    const bool stuck = std::exchange(watched.seen, beats) == beats;
    if (stuck) finding.alive = false;
    const bool was_stuck = std::exchange(watched.stuck, stuck);
    if (stuck && !was_stuck) finding.stuck.push_back(watched.thread.thread);
    if (!stuck && was_stuck) finding.again.push_back(watched.thread.thread);
  }
  return finding;
}

}  // namespace posed::service
