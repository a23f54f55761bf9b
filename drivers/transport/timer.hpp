// Timer: a timerfd on CLOCK_MONOTONIC, the descriptor of sources that have none of their own. Its
// times are absolute, so a late wake-up never moves the schedule.
#pragma once

#include <cstdint>

#include "proto/frame/result.hpp"

namespace posed::drivers {

class Timer {
 public:
  Timer() = default;
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;
  ~Timer();

  [[nodiscard]] Result<> open();                         // cold; an error when descriptors run out
  [[nodiscard]] int fd() const noexcept { return fd_; }  // readable once due

  // Due at `first_ns` and every `period_ns` after it.
  void every(std::int64_t first_ns, std::int64_t period_ns) noexcept;
  // Due once, at `time_ns`; a time that is past is due at once. One system call.
  void at(std::int64_t time_ns) noexcept { every(time_ns, 0); }

  // How often it fell due since the last call; one read, never blocks. RT-safe.
  [[nodiscard]] std::uint64_t expirations() noexcept;

 private:
  int fd_ = -1;
};

}  // namespace posed::drivers
