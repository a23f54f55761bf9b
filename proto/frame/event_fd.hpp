// RawEventFd: a descriptor that any thread can make readable, so that another one wakes from its
// wait (eventfd).
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

namespace posed {

class RawEventFd {
 public:
  RawEventFd() noexcept : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  ~RawEventFd() {
    if (fd_ >= 0) ::close(fd_);
  }
  RawEventFd(const RawEventFd&) = delete;
  RawEventFd& operator=(const RawEventFd&) = delete;

  // -1 when no descriptor was available; errno says why. It is readable once signal() was called.
  [[nodiscard]] int fd() const noexcept { return fd_; }

  // Any thread. One system call; RT-safe except for it.
  void signal() noexcept {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
  }
  // Makes it unreadable until the next signal(). One system call.
  void clear() noexcept {
    std::uint64_t signals = 0;
    [[maybe_unused]] const ssize_t read = ::read(fd_, &signals, sizeof signals);
  }

 private:
  int fd_;
};

}  // namespace posed
