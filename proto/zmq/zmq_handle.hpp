// Owners of libzmq's handles. The C API is used on purpose: it reports errors by return value, so
// there is no exception to catch, and EINTR reaches the caller; that is how Ctrl-C ends a client.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <zmq.h>

#include "proto/frame/result.hpp"

namespace posed::net {

struct CloseSocket {
  void operator()(void* socket) const noexcept { zmq_close(socket); }
};
using Socket = std::unique_ptr<void, CloseSocket>;

// Waits until every socket of the context is closed, so declare the context before them.
struct EndContext {
  void operator()(void* context) const noexcept {
    while (zmq_ctx_term(context) != 0 && zmq_errno() == EINTR) {
    }
  }
};
using Context = std::unique_ptr<void, EndContext>;

// One received part; its bytes are valid until the next receive() or the destructor.
class Message {
 public:
  Message() noexcept { zmq_msg_init(&message_); }
  ~Message() { zmq_msg_close(&message_); }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;

  // Returns false if nothing was waiting or a signal came (errno is EAGAIN, EINTR, ...).
  [[nodiscard]] bool receive(void* socket, int flags = ZMQ_DONTWAIT) noexcept {
    return zmq_msg_recv(&message_, socket, flags) >= 0;
  }
  [[nodiscard]] bool more() const noexcept { return zmq_msg_more(&message_) != 0; }
  [[nodiscard]] std::string_view text() const noexcept {
    // libzmq's function only reads, but accepts no const pointer
    auto* raw = const_cast<zmq_msg_t*>(&message_);
    return {static_cast<const char*>(zmq_msg_data(raw)), zmq_msg_size(raw)};
  }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::as_bytes(std::span(text()));
  }
  // A property of the connection, such as "User-Id"; empty if it has none.
  [[nodiscard]] std::string_view property(const char* name) const noexcept {
    const char* value = zmq_msg_gets(&message_, name);
    return value == nullptr ? std::string_view{} : std::string_view{value};
  }

 private:
  zmq_msg_t message_;
};

Result<Context> open_context();
// An error when so many threads cannot begin now. Cold.
Result<> check_threads(int count);

// A socket that drops unsent messages when it is closed (linger 0).
Result<Socket> open_socket(void* context, int type);

Result<> set_option(void* socket, int option, int value);
Result<> set_option(void* socket, int option, std::string_view value);

// Refuses a port that does not exist, and an ipc:// path that is too long.
Result<> check_endpoint(const std::string& endpoint);
// Refuses an ipc:// path at which there is something else than a socket: libzmq would delete it.
Result<> check_ipc_file(const std::string& endpoint);

// Binds and returns the endpoint that is really bound ("tcp://127.0.0.1:*" picks a free port). If
// the port, or the file of ipc://, is in use, the error says so in one sentence.
Result<std::string> bind_socket(void* socket, const std::string& endpoint);
// Connects now or as soon as somebody listens there, and connects again after a loss, which
// keep-alive packets detect where the peer vanished silently.
Result<> connect_socket(void* socket, const std::string& endpoint);

// Makes the socket learn at once what its peers have read. A busy socket otherwise learns it once a
// millisecond, and mistakes a peer that is reading for one that is not.
void update_peers(void* socket) noexcept;

// Returns whether libzmq accepted the part; never blocks.
[[nodiscard]] bool send_part(void* socket, std::string_view bytes, bool more) noexcept;

}  // namespace posed::net
