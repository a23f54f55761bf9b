// Cancel: ends every wait while a device opens (its start-up session, a glove that may connect)
// when the daemon is asked to stop. Once fired it stays fired.
#pragma once

#include <atomic>

#include "proto/frame/event_fd.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

class Cancel {
 public:
  // Any thread.
  void fire() noexcept {
    fired_.store(true);
    event_.signal();
  }
  [[nodiscard]] bool fired() const noexcept { return fired_.load(); }

  // Readable once fired; -1 when no descriptor was available: then waits end at their own timeout.
  [[nodiscard]] int fd() const noexcept { return event_.fd(); }

  // The result of a cancelled wait; it is not shown to the user.
  [[nodiscard]] static std::unexpected<Error> error() {
    return fail("posed stops: the device is left as it is");
  }

 private:
  RawEventFd event_;
  std::atomic<bool> fired_{false};
};

}  // namespace posed::drivers
