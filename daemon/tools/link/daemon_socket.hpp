// DaemonSocket: the connection of a tool to a daemon or a relay, shared by commands, bridge and
// relay. libzmq makes it in the background and again after a loss; only few messages wait anywhere,
// so what comes after a stall is new. One thread uses it. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "daemon/net/refusal_words.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/link_monitor.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::link {

// Whom to connect to, and with which keys.
struct Peer {
  std::string endpoint{};
  std::filesystem::path key{};         // one's own NAME.key; empty: no CURVE
  std::filesystem::path server_key{};  // the daemon's NAME.pub
};

struct Limits {
  int messages = 64;               // that wait here; the skeletons of streams come together
  int receive_buffer = 16 * 1024;  // bytes, of the kernel
  std::int64_t largest_part = 1024 * 1024;  // bytes; the stats of 256 streams have about 200 KB
  int requests = 64;                        // or subscriptions, that wait to be sent
  bool only_connected = false;  // refuse requests while there is no connection, instead of sending
                                // them when there is one, much later
};

enum class Received { kNothing, kMessage, kMalformed };

class DaemonSocket {
 public:
  // `type` is ZMQ_SUB, ZMQ_XSUB or ZMQ_DEALER. Returns at once. `context` outlives the socket.
  static Result<DaemonSocket> open(void* context, int type, Peer peer, const Limits& limits);

  [[nodiscard]] void* get() const noexcept { return socket_.get(); }
  [[nodiscard]] const Peer& peer() const noexcept { return peer_; }
  [[nodiscard]] net::Domain domain() const noexcept { return domain_; }
  [[nodiscard]] void* news() const noexcept { return monitor_.socket(); }  // readable: refusal()

  // The next message, if one waits. One that is not of two parts is skipped whole and malformed.
  [[nodiscard]] Received receive(net::Message& first, net::Message& second) noexcept;

  // Reads what happened to the connection. Returns why the daemon refuses it, as the end of a
  // sentence that begins with the daemon's name; empty if it does not.
  [[nodiscard]] std::string refusal();
  // Both as of the last call of refusal(): whether the connection stands, and how many have ended.
  [[nodiscard]] bool established() const noexcept { return monitor_.established(); }
  [[nodiscard]] std::uint64_t ends() const noexcept { return monitor_.ends(); }

 private:
  DaemonSocket(Peer peer, net::Domain domain, net::Socket socket, net::LinkMonitor monitor)
      : peer_(std::move(peer)),
        domain_(domain),
        socket_(std::move(socket)),
        monitor_(std::move(monitor)) {}

  Peer peer_;
  net::Domain domain_;
  net::Socket socket_;
  net::LinkMonitor monitor_;
};

}  // namespace posed::link
