// Service: reports to systemd, which started the daemon as a service (Type=notify), that it is
// ready, its state, that it ends, and a sign of life while all of its threads make progress.
// Without systemd (NOTIFY_SOCKET is not set) it does nothing. One thread; cold.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/service/watchdog.hpp"
#include "daemon/system/pulse.hpp"

namespace posed::service {

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

}  // namespace posed::service
