// Service: reports to systemd, which started the daemon as a service (Type=notify), that it is
// ready, its state, that it ends, and a sign of life while all of its threads make progress.
// Without systemd (NOTIFY_SOCKET is not set) it does nothing. One thread; cold.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/system/pulse.hpp"

namespace posed::service {

// Finds the threads that have made no progress lately. The time and the state of a thread are
// parameters, so a test can choose them. Takes no lock that a watched thread could hold. One
// thread; cold.
class Watchdog {
 public:
  // The watchdog looks this often within the time in which the service manager wants a sign of
  // life. So one look that finds a thread without progress is no alarm yet, and a stuck thread is
  // found soon.
  static constexpr std::int64_t kLooks = 4;
  // Returns for a thread's name whether the kernel lets that thread wait for a disk
  // (waits_for_disk). It is called only for threads without progress.
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

class Service {
 public:
  // `threads` are watched if systemd asks for signs of life (WATCHDOG_USEC); their pulses outlive
  // this object.
  explicit Service(std::vector<system::ThreadPulse> threads);

  // Whether systemd listens. A service has no terminal that could be closed.
  [[nodiscard]] bool present() const noexcept { return present_; }

  void ready();      // clients may connect; call it again after reloading()
  void reloading();  // the config is being read again
  void stopping();
  // Sets the sentence that `systemctl status` shows. It is sent only if it differs from the last
  // one.
  void status(const std::string& sentence);
  // Sends the sign of life when it is due. A stuck thread is named in the log, and no sign of life
  // is sent until it goes on; a thread that waits for a disk is only named. Call it several times a
  // second.
  void turn(std::int64_t now_ns);

 private:
  void notify(const std::string& words);

  bool present_;
  bool warned_ = false;
  std::string status_;
  std::optional<Watchdog> watchdog_;
};

// The state of one of this process's threads, as the kernel reports it. Cold. Whether the kernel
// lets the thread of this name wait uninterruptibly (state D), as it does for a disk that does not
// answer. Only the first 15 letters of the name count (name_thread()); false if there is no such
// thread.
[[nodiscard]] bool waits_for_disk(const std::string& thread);

}  // namespace posed::service
