#include "daemon/service/watchdog.hpp"

#include <utility>

namespace posed::service {

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

}  // namespace posed::service
