// How one thread waits: a EventFd (eventfd) that other threads ring, and a Poller (epoll) that
// waits for it and for devices until a deadline. One EventFd per consuming thread.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {

class EventFd {
 public:
  [[nodiscard]] static Result<std::unique_ptr<EventFd>> open();
  ~EventFd();
  EventFd(const EventFd&) = delete;
  EventFd& operator=(const EventFd&) = delete;

  // Any thread, after it has put something where the consumer looks. Writes to the eventfd only
  // when the consumer sleeps. RT-safe but for that one write.
  void notify() noexcept;

  // The consumer, before its last look at its rings: from here on notify() writes.
  void going_to_sleep() noexcept { asleep_.exchange(true, std::memory_order_acq_rel); }
  // The consumer, back from its wait.
  void awake() noexcept { asleep_.exchange(false, std::memory_order_acq_rel); }

  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  explicit EventFd(int fd) noexcept : fd_(fd) {}
  int fd_;
  // No wake-up is missed, on any memory model. Every change of the flag is an exchange with acquire
  // and release, so each one synchronizes with all before it in the flag's modification order (a
  // chain of read-modify-writes keeps a release sequence whole). Say a producer puts an element in
  // and its exchange finds false, so that it writes nothing. The consumer's next exchange, in
  // awake() or going_to_sleep(), comes after the producer's and so sees the element at the look
  // that follows it; it cannot have come before, or the producer would have found its true. A plain
  // store in awake() would cut the chain: a second producer could find false between the first
  // one's write and that store, and its element would be visible to nobody in particular.
  std::atomic<bool> asleep_{false};
};

inline constexpr std::int64_t kForever_ns = std::numeric_limits<std::int64_t>::max();

// How long a thread may sleep whose next turn is due then; never negative. RT-safe.
[[nodiscard]] inline std::int64_t time_left_ns(std::int64_t due_ns, Clock clock) noexcept {
  return due_ns == kForever_ns ? kForever_ns : std::max<std::int64_t>(due_ns - clock(), 0);
}

class Poller {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Poller>> open();
  ~Poller();
  Poller(const Poller&) = delete;
  Poller& operator=(const Poller&) = delete;

  // A EventFd: edge-triggered, so that it never needs to be read.
  [[nodiscard]] Result<> add(const EventFd& wake);
  // A device's descriptor: level-triggered; `key` comes back from wait().
  [[nodiscard]] Result<> add(int fd, std::uint32_t key);
  // A device that has ended: its descriptor would stay readable for ever.
  void remove(int fd) noexcept;

  // Sleeps until something is ready or for `timeout_ns`; returns the keys of the ready devices
  // (the EventFd has none), valid until the next wait. One system call, RT-safe but for it.
  [[nodiscard]] std::span<const std::uint32_t> wait(std::int64_t timeout_ns) noexcept;

 private:
  explicit Poller(int fd) noexcept : fd_(fd) {}
  static constexpr int kMaxReady = 64;
  int fd_;
  std::array<std::uint32_t, kMaxReady> ready_{};
};

}  // namespace posed::system
