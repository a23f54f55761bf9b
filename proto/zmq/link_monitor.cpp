#include "proto/zmq/link_monitor.hpp"

#include <atomic>
#include <cstring>
#include <string>
#include <utility>

namespace posed::net {
namespace {

// A secured daemon may close the connection to a client without a key before the client has read
// the ZMTP greeting, and whoever has a socket of another kind closes it as well; libzmq then
// reports no reason. So the client concludes that it was refused only after it was closed on this
// many times in a row; a daemon that is merely ending is not there for a second try.
constexpr int kHangUps = 3;

constexpr int kEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                        ZMQ_EVENT_DISCONNECTED;

// Reads the first part of a monitor message: event number and value (zmq_socket_monitor).
std::uint16_t read_event(void* monitor) {
  Message part;
  if (!part.receive(monitor)) return 0;
  std::uint16_t event = 0;
  if (part.text().size() >= sizeof event) std::memcpy(&event, part.text().data(), sizeof event);
  while (part.more() && part.receive(monitor, 0)) {
  }
  return event;
}

}  // namespace

Result<LinkMonitor> LinkMonitor::open(void* context, void* socket, bool with_key) {
  // unique names, because a context may have several
  static std::atomic<unsigned> number{0};
  const std::string endpoint = "inproc://posed.link." + std::to_string(++number);
  if (zmq_socket_monitor(socket, endpoint.c_str(), kEvents) != 0) {
    return fail(std::string("cannot watch the connection: ") + zmq_strerror(zmq_errno()));
  }
  auto monitor = TRY(open_socket(context, ZMQ_PAIR));
  TRY(connect_socket(monitor.get(), endpoint));
  return LinkMonitor(std::move(monitor), with_key);
}

Refusal LinkMonitor::next_refusal() {
  while (const std::uint16_t event = read_event(monitor_.get())) {
    switch (event) {
      case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
        established_ = true;
        hang_ups_ = 0;
        break;
      case ZMQ_EVENT_DISCONNECTED: {
        const bool known = std::exchange(failure_known_, false);
        const bool was_established = std::exchange(established_, false);
        if (was_established) ++ends_;
        // This side was the first to see that the sockets do not match; libzmq tries no more.
        if (!was_established && !known) return Refusal::kOtherSocket;
        break;
      }
      case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
        failure_known_ = true;
        return Refusal::kKeyNotAllowed;
      case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
        failure_known_ = true;
        return with_key_ ? Refusal::kTalksNoKeys : Refusal::kWantsKey;
      case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
        failure_known_ = true;
        if (with_key_) return Refusal::kHangsUp;
        if (++hang_ups_ == kHangUps) return Refusal::kHangsUpKeyless;
        break;
      default:
        break;
    }
  }
  return Refusal::kNone;
}

}  // namespace posed::net
