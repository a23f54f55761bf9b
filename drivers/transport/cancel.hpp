// Cancel: ends every wait while a device opens (its start-up session, a glove that may connect)
// when the daemon is asked to stop. Once fired it stays fired.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>

#include "proto/frame/result.hpp"

namespace posed::drivers {

class Cancel {
 public:
  Cancel() noexcept : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  ~Cancel() {
    if (fd_ >= 0) ::close(fd_);
  }
  Cancel(const Cancel&) = delete;
  Cancel& operator=(const Cancel&) = delete;

  // Any thread.
  void fire() noexcept {
    fired_.store(true);
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
  }
  [[nodiscard]] bool fired() const noexcept { return fired_.load(); }

  // Readable once fired; -1 when no descriptor was available: then waits end at their own timeout.
  [[nodiscard]] int fd() const noexcept { return fd_; }

  // The result of a cancelled wait; it is not shown to the user.
  [[nodiscard]] static std::unexpected<Error> error() {
    return fail("posed stops: the device is left as it is");
  }

 private:
  int fd_;
  std::atomic<bool> fired_{false};
};

}  // namespace posed::drivers
