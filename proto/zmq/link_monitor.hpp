// LinkMonitor: what libzmq says about the one connection of a socket that connects to a daemon:
// whether it is established, and why the daemon refuses this client. One thread uses it. Cold.
#pragma once

#include <cstdint>

#include "proto/frame/result.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {

// Why a daemon admits a client never, as far as the connection shows.
enum class Refusal : std::uint8_t {
  kNone,
  kKeyNotAllowed,   // the key is not on the daemon's list, or lacks the right
  kTalksNoKeys,     // the daemon uses no keys, or is something else
  kHangsUp,         // the server's key is not the daemon's, or the daemon just ended
  kWantsKey,        // the daemon uses keys, and this client none
  kOtherSocket,     // the socket there is of another kind, such as control's for a subscriber
  kHangsUpKeyless,  // one of the last two
};

class LinkMonitor {
 public:
  // Call before the socket connects; destroy the monitor before the socket. `with_key`: the client
  // uses CURVE.
  [[nodiscard]] static Result<LinkMonitor> open(void* context, void* socket, bool with_key);

  [[nodiscard]] void* socket() const noexcept { return monitor_.get(); }  // to wait for news

  // Takes the news until a refusal is among them.
  [[nodiscard]] Refusal take_news();
  // As of the last call of take_news(): whether the connection stands, and how often one has ended.
  [[nodiscard]] bool established() const noexcept { return established_; }
  [[nodiscard]] std::uint64_t ends() const noexcept { return ends_; }

 private:
  LinkMonitor(Socket monitor, bool with_key) : monitor_(std::move(monitor)), with_key_(with_key) {}

  Socket monitor_;
  bool with_key_;
  bool established_ = false;
  std::uint64_t ends_ = 0;
  int hang_ups_ = 0;           // in a row, before the handshake
  bool failure_told_ = false;  // libzmq has told why the handshake of this connection failed
};

}  // namespace posed::net
