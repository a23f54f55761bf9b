// What libzmq reports of a socket's connections (zmq_socket_monitor(3)): accepted, connected,
// ended.
#pragma once

#include <cstdint>
#include <optional>

#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {

struct SocketEvent {
  std::uint16_t number = 0;  // ZMQ_EVENT_...
  std::int32_t value = 0;    // a descriptor, or a reason
};

// One thread at a time. The socket outlives it, and its owner calls open() and the destructor.
class SocketEvents {
 public:
  // `events` is a sum of ZMQ_EVENT_... Returns an error where libzmq has no sockets left.
  static Result<SocketEvents> open(void* context, void* socket, int events);
  ~SocketEvents();
  SocketEvents(SocketEvents&& other) noexcept;
  SocketEvents& operator=(SocketEvents&&) = delete;
  SocketEvents(const SocketEvents&) = delete;
  SocketEvents& operator=(const SocketEvents&) = delete;

  // Becomes readable when something happens: then call next() until it has nothing more.
  [[nodiscard]] int fd() const noexcept { return fd_; }
  // Does not wait; nullopt: nothing more has happened.
  [[nodiscard]] std::optional<SocketEvent> next() noexcept;

 private:
  SocketEvents(void* socket, Socket monitor, int fd) noexcept;

  void* socket_;
  Socket monitor_;
  int fd_;
};

}  // namespace posed::net
