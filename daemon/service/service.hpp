// Service: what a daemon tells systemd that started it as a service (Type=notify): ready, its
// state, ending, and a sign of life while all of its threads make progress. Without systemd
// (NOTIFY_SOCKET is not set) it does nothing. One thread; cold.
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

  void ready();      // clients may come; also after reloading()
  void reloading();  // the config is read again
  void stopping();
  // A sentence for `systemctl status`. Sent only if it is another one than before.
  void status(const std::string& sentence);
  // Sends the sign of life when it is due. A thread that is stuck is named in the log, and there
  // are no more signs until it goes on; one that waits for a disk is named only. Call several times
  // a second.
  void turn(std::int64_t now_ns);

 private:
  void tell(const std::string& words);

  bool present_;
  bool warned_ = false;
  std::string status_;
  std::optional<Watchdog> watchdog_;
};

}  // namespace posed::service
