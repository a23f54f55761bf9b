// How a thread waits: an EventFd (eventfd) that other threads notify, and a Poller (epoll) that
// waits for it and for devices until a deadline. Each consuming thread has one EventFd.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "daemon/system/pulse.hpp"
#include "proto/frame/event_fd.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

class EventFd {
 public:
  static Result<std::unique_ptr<EventFd>> open();
  EventFd(const EventFd&) = delete;
  EventFd& operator=(const EventFd&) = delete;

  // Any thread calls it after it has put something where the consumer looks. It writes to the
  // eventfd only if the consumer sleeps. RT-safe except for that one write.
  void notify() noexcept;

  // The consumer calls it before its last look at its rings; from then on notify() writes to the
  // eventfd.
  void going_to_sleep() noexcept { asleep_.exchange(true, std::memory_order_acq_rel); }
  // The consumer calls it after its wait.
  void awake() noexcept { asleep_.exchange(false, std::memory_order_acq_rel); }

  [[nodiscard]] int fd() const noexcept { return event_.fd(); }

 private:
  EventFd() noexcept = default;
  RawEventFd event_;
  // No wake-up is missed, on any memory model. Every change of the flag is an exchange with acquire
  // and release, so each one synchronizes with all earlier ones in the flag's modification order (a
  // chain of read-modify-writes keeps a release sequence whole). Suppose a producer adds an element
  // and its exchange returns false, so it does not write. The consumer's next exchange, in awake()
  // or going_to_sleep(), must come after the producer's, because otherwise the producer would have
  // seen the consumer's true; so the consumer sees the element at its next look. A plain store in
  // awake() would break the chain: a second producer could read false between the first producer's
  // write and that store, and then nothing would guarantee that the consumer sees the second
  // producer's element.
  std::atomic<bool> asleep_{false};
};

inline constexpr std::int64_t kForever_ns = std::numeric_limits<std::int64_t>::max();

// How long a thread may sleep when its next turn is due at `due_ns`: never negative, and never so
// long that it seems to be stuck.
RT_SAFE [[nodiscard]] inline std::int64_t time_left_ns(std::int64_t due_ns, Clock clock) noexcept {
  return std::clamp<std::int64_t>(due_ns - clock(), 0, kMaxSleep_ns);
}

// Sleeps for `time_ns`, whatever happens; returns at once if that is 0. One system call; RT-safe
// except for it.
void rest(std::int64_t time_ns) noexcept;

class Poller {
 public:
  static Result<std::unique_ptr<Poller>> open();
  ~Poller();
  Poller(const Poller&) = delete;
  Poller& operator=(const Poller&) = delete;

  // Adds an EventFd; it is edge-triggered, so that it never needs to be read.
  Result<> add(const EventFd& wake);
  // Adds a device's descriptor; it is level-triggered, and wait() returns its `key`.
  Result<> add(int fd, std::uint32_t key);
  // Removes the descriptor of a device that has ended; it would stay readable for ever.
  void remove(int fd) noexcept;

  // Sleeps until something is ready or `timeout_ns` has passed; returns the keys of the ready
  // devices (an EventFd has none), valid until the next wait. One system call; RT-safe except for
  // it.
  [[nodiscard]] std::span<const std::uint32_t> wait(std::int64_t timeout_ns) noexcept;

 private:
  explicit Poller(int fd) noexcept : fd_(fd) {}
  static constexpr int kMaxReady = 64;
  int fd_;
  std::array<std::uint32_t, kMaxReady> ready_{};
};

}  // namespace posed::system
