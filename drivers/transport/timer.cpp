#include "drivers/transport/timer.hpp"

#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "proto/frame/time.hpp"

namespace posed::drivers {
namespace {

timespec to_timespec(std::int64_t time_ns) noexcept {
  return {.tv_sec = time_ns / kNanosPerSecond, .tv_nsec = time_ns % kNanosPerSecond};
}

}  // namespace

Timer::~Timer() {
  if (fd_ >= 0) ::close(fd_);
}

Result<> Timer::open() {
  fd_ = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  if (fd_ >= 0) return {};
  return fail(std::string("cannot make a timer: ") + std::strerror(errno) +
              "; close other programs or raise the limit of open files (ulimit -n)");
}

void Timer::every(std::int64_t first_ns, std::int64_t period_ns) noexcept {
  itimerspec spec{};
  spec.it_value = to_timespec(std::max<std::int64_t>(first_ns, 1));  // 0 would disarm it
  spec.it_interval = to_timespec(std::max<std::int64_t>(period_ns, 0));
  // Cannot fail: the descriptor is a timer and both times are in range.
  (void)::timerfd_settime(fd_, TFD_TIMER_ABSTIME, &spec, nullptr);
}

std::uint64_t Timer::expirations() noexcept {
  std::uint64_t count = 0;
  return ::read(fd_, &count, sizeof count) == sizeof count ? count : 0;
}

}  // namespace posed::drivers
