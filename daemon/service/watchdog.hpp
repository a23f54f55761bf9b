// Watchdog: finds the threads that have made no progress lately. The time and the state of a thread
// are parameters, so a test can choose them. Takes no lock that a watched thread could hold. One
// thread; cold.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "daemon/system/pulse.hpp"

namespace posed::service {

class Watchdog {
 public:
  // The watchdog looks this often within the time in which the service manager wants a sign of
  // life. So one look that finds a thread without progress is no alarm yet, and a stuck thread is
  // found soon.
  static constexpr std::int64_t kLooks = 4;
  // Returns for a thread's name whether the kernel lets that thread wait for a disk
  // (system::waits_for_disk). It is called only for threads without progress.
  using WaitsForDisk = std::function<bool(const std::string&)>;

  // The service manager wants a sign of life every `within_ns`. A kLooks-th of it has to be longer
  // than system::kMaxSleep_ns.
  Watchdog(std::vector<system::ThreadPulse> threads, std::int64_t within_ns,
           WaitsForDisk waits_for_disk);

  // The lists name the threads whose state has changed since the last look.
  struct Finding {
    bool alive = false;                // a look was due, and no thread is stuck
    std::vector<std::string> stuck;    // they made no progress since the last look
    std::vector<std::string> waiting;  // they made none because they wait for a disk
    std::vector<std::string> again;    // they make progress again after one of the two
  };
  // Call it several times within each kLooks-th part of `within_ns`.
  [[nodiscard]] Finding look(std::int64_t now_ns);

 private:
  enum class State : std::uint8_t { kGoesOn, kStuck, kWaits };
  struct Watched {
    system::ThreadPulse thread;
    std::uint64_t seen = 0;  // beats at the last look
    State state = State::kGoesOn;
  };
  [[nodiscard]] State state_of(Watched& watched) const;

  std::vector<Watched> watched_;
  std::int64_t every_ns_;
  WaitsForDisk waits_for_disk_;
  std::int64_t looked_ns_ = kNoTime_ns;
};

}  // namespace posed::service
