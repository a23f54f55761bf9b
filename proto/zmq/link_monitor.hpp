// LinkMonitor: follows the one connection of a socket that connects to a daemon: whether it is
// established, and why the daemon refuses this client. One thread uses it. Cold.
#pragma once

#include <cstdint>

#include "proto/frame/result.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {

// Why a daemon will never admit a client, as far as the connection shows.
enum class Refusal : std::uint8_t {
  kNone,
  kKeyNotAllowed,   // the key is not on the daemon's list, or lacks the right
  kTalksNoKeys,     // the daemon uses no keys, or is something else
  kHangsUp,         // the server's key is not the daemon's, or the daemon just ended
  kWantsKey,        // the daemon uses keys, and this client none
  kOtherSocket,     // the socket there is of another kind, such as control's for a subscriber
  kHangsUpKeyless,  // kWantsKey or kOtherSocket
};

class LinkMonitor {
 public:
  // Call before the socket connects; destroy the monitor before the socket. `with_key`: the client
  // uses CURVE.
  static Result<LinkMonitor> open(void* context, void* socket, bool with_key);

  [[nodiscard]] void* socket() const noexcept { return monitor_.get(); }  // readable: events wait

  // Handles the events that wait, up to the first refusal, and returns it; kNone: none refuses.
  [[nodiscard]] Refusal next_refusal();
  // As of the last next_refusal(): whether the connection stands, and how often one has ended.
  [[nodiscard]] bool established() const noexcept { return established_; }
  [[nodiscard]] std::uint64_t ends() const noexcept { return ends_; }

 private:
  LinkMonitor(Socket monitor, bool with_key) : monitor_(std::move(monitor)), with_key_(with_key) {}

  Socket monitor_;
  bool with_key_;
  bool established_ = false;
  std::uint64_t ends_ = 0;
  int hang_ups_ = 0;            // in a row, before the handshake
  bool failure_known_ = false;  // libzmq has reported why this connection's handshake failed
};

}  // namespace posed::net
