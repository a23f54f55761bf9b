#include "proto/zmq/socket_events.hpp"

#include <atomic>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace posed::net {

Result<SocketEvents> SocketEvents::open(void* context, void* socket, int events) {
  // unique names, because a context may have several
  static std::atomic<unsigned> number{0};
  const std::string endpoint = "inproc://posed.events." + std::to_string(++number);
  if (zmq_socket_monitor(socket, endpoint.c_str(), events) != 0) {
    return fail(std::string("cannot watch connections: ") + zmq_strerror(zmq_errno()));
  }
  auto monitor = TRY(open_socket(context, ZMQ_PAIR));
  // No limit: otherwise libzmq's own thread would wait here until the events are read.
  TRY(set_option(monitor.get(), ZMQ_RCVHWM, 0));
  TRY(connect_socket(monitor.get(), endpoint));
  int fd = -1;
  std::size_t size = sizeof fd;
  if (zmq_getsockopt(monitor.get(), ZMQ_FD, &fd, &size) != 0) {
    return fail("ZeroMQ names no descriptor to wait for");
  }
  return SocketEvents(socket, std::move(monitor), fd);
}

SocketEvents::SocketEvents(void* socket, Socket monitor, int fd) noexcept
    : socket_(socket), monitor_(std::move(monitor)), fd_(fd) {}

SocketEvents::SocketEvents(SocketEvents&& other) noexcept
    : socket_(std::exchange(other.socket_, nullptr)),
      monitor_(std::move(other.monitor_)),
      fd_(other.fd_) {}

SocketEvents::~SocketEvents() {
  if (socket_ != nullptr) zmq_socket_monitor(socket_, nullptr, 0);
}

// A monitor's message has two parts: the number (16 bits) with the value (32 bits), then the
// endpoint.
std::optional<SocketEvent> SocketEvents::next() noexcept {
  Message part;
  if (!part.receive(monitor_.get())) return std::nullopt;
  SocketEvent event;
  const std::string_view text = part.text();
  if (text.size() == sizeof event.number + sizeof event.value) {
    std::memcpy(&event.number, text.data(), sizeof event.number);
    std::memcpy(&event.value, text.data() + sizeof event.number, sizeof event.value);
  }
  while (part.more() && part.receive(monitor_.get(), 0)) {
  }
  return event;
}

}  // namespace posed::net
