// Watchdog: whether every thread has made progress lately. The time is a parameter, so a test can
// choose it. Takes no lock that a watched thread could hold. One thread; cold.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/system/pulse.hpp"

namespace posed::service {

class Watchdog {
 public:
  // The service manager wants a sign of life every `within_ns`; one is due twice as often. That
  // has to be longer than system::kLongestSleep_ns.
  Watchdog(std::vector<system::ThreadPulse> threads, std::int64_t within_ns);

  struct Finding {
    bool alive = false;  // a look was due, and every thread made progress since the last
    std::vector<std::string> stuck;  // threads that have just been found without progress
    std::vector<std::string> again;  // threads that go on after they were found so
  };
  // Call several times within half of that time.
  [[nodiscard]] Finding look(std::int64_t now_ns);

 private:
  struct Watched {
    system::ThreadPulse thread;
    std::uint64_t seen = 0;  // beats at the last look
    bool stuck = false;
  };
  std::vector<Watched> watched_;
  std::int64_t every_ns_;
  std::int64_t looked_ns_ = kNoTime_ns;
};

}  // namespace posed::service
