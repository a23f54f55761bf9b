#include "daemon/system/event_fd.hpp"

#include <cerrno>

#include <sys/epoll.h>
#include <time.h>
#include <unistd.h>

#include "daemon/system/hot_mark.hpp"
#include "proto/frame/time.hpp"

namespace posed::system {
namespace {

constexpr std::uint32_t kWakeKey = std::numeric_limits<std::uint32_t>::max();

std::unexpected<Error> system_error(const char* what) {
  return fail(std::string(what) + ": " + errno_text() +
              "; raise the limit of open files (ulimit -n)");
}

}  // namespace

Result<std::unique_ptr<EventFd>> EventFd::open() {
  std::unique_ptr<EventFd> made(new EventFd());
  if (made->fd() < 0) return system_error("cannot make an eventfd");
  return made;
}

void EventFd::notify() noexcept {
  // Both sides exchange the flag, and the later exchange sees what the other side did before:
  // either the consumer finds the new element, or this thread finds the consumer asleep.
  if (!asleep_.exchange(false, std::memory_order_acq_rel)) return;
  const AllowedCall allowed;
  event_.signal();
}

void rest(std::int64_t time_ns) noexcept {
  if (time_ns <= 0) return;
  const timespec time{.tv_sec = time_ns / kNanosPerSecond, .tv_nsec = time_ns % kNanosPerSecond};
  const AllowedCall allowed;
  nanosleep(&time, nullptr);
}

Result<std::unique_ptr<Poller>> Poller::open() {
  const int fd = epoll_create1(EPOLL_CLOEXEC);
  if (fd < 0) return system_error("cannot make an epoll set");
  std::unique_ptr<Poller> poller(new Poller(fd));
  // Where the kernel or a container refuses this call, each wait would return at once, for ever.
  epoll_event none;
  const timespec at_once{};
  if (epoll_pwait2(fd, &none, 1, &at_once, nullptr) < 0) {
    return fail("cannot wait for devices: epoll_pwait2: " + errno_text() +
                "; posed needs Linux 5.11 or newer, and a container that lets it make this call");
  }
  return poller;
}

Poller::~Poller() { close(fd_); }

Result<> Poller::add(const EventFd& wake) {
  epoll_event event{};
  event.events = EPOLLIN | EPOLLET;
  event.data.u32 = kWakeKey;
  if (epoll_ctl(fd_, EPOLL_CTL_ADD, wake.fd(), &event) != 0) return system_error("cannot poll");
  return {};
}

Result<> Poller::add(int fd, std::uint32_t key) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u32 = key;
  if (epoll_ctl(fd_, EPOLL_CTL_ADD, fd, &event) != 0) return system_error("cannot poll a device");
  return {};
}

void Poller::remove(int fd) noexcept {
  const AllowedCall once_a_device;
  epoll_ctl(fd_, EPOLL_CTL_DEL, fd, nullptr);
}

std::span<const std::uint32_t> Poller::wait(std::int64_t timeout_ns) noexcept {
  std::array<epoll_event, kMaxReady> events;
  timespec timeout{};
  timeout.tv_sec = timeout_ns / kNanosPerSecond;
  timeout.tv_nsec = timeout_ns % kNanosPerSecond;
  int count = 0;
  {
    const AllowedCall allowed;
    count = epoll_pwait2(fd_, events.data(), kMaxReady,
                         timeout_ns == kForever_ns ? nullptr : &timeout, nullptr);
  }
  std::size_t ready = 0;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t key = events[i].data.u32;
    if (key != kWakeKey) ready_[ready++] = key;
  }
  return std::span(ready_).first(ready);
}

}  // namespace posed::system
