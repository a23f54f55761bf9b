// DaemonSocket: the connection of a tool to a daemon or a relay, shared by commands, bridge and
// relay. libzmq makes it in the background and again after a loss; only few messages wait anywhere,
// so what comes after a stall is new. One thread uses it. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daemon/net/security.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"
#include "proto/zmq/link_monitor.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::link {

// Whom to connect to, and with which keys.
struct Peer {
  std::string endpoint{};
  std::filesystem::path key{};         // one's own NAME.key; empty: no CURVE
  std::filesystem::path server_key{};  // the daemon's NAME.pub
};

// Bytes of a message of a stream; a skeleton of 256 joints has about 30 KB. Only stats are longer.
inline constexpr std::size_t kMaxStreamMessage = 64 * 1024;
// Streams that come through one connection: a relay passes on no more, of all its upstreams.
inline constexpr std::size_t kMaxLinkStreams = 2048;

struct Limits {
  int messages = 48;               // that wait here; large skeletons that come together need 1.5 MB
  int receive_buffer = 16 * 1024;  // bytes, of the kernel
  int requests = 64;               // or subscriptions, that wait to be sent
  bool only_connected = false;  // refuse requests while there is no connection, instead of sending
                                // them when there is one, much later
};

enum class Received { kNothing, kMessage, kMalformed };

class DaemonSocket {
 public:
  // `type` is ZMQ_SUB, ZMQ_XSUB or ZMQ_DEALER. Returns at once. `context` outlives the socket.
  static Result<DaemonSocket> open(void* context, int type, Peer peer, const Limits& limits);

  // To wait, to send and to set options; what comes is received below.
  [[nodiscard]] void* get() const noexcept { return socket_.get(); }
  [[nodiscard]] const Peer& peer() const noexcept { return peer_; }
  [[nodiscard]] net::Domain domain() const noexcept { return domain_; }
  [[nodiscard]] int news_fd() const noexcept { return monitor_->fd(); }  // readable: refusal()

  // The next message, if one waits. One that is not of two parts is skipped whole and malformed.
  [[nodiscard]] Received receive(net::Message& first, net::Message& second) noexcept;
  // The next part, if a message waits.
  [[nodiscard]] bool receive(net::Message& part) noexcept { return monitor_->receive(part); }

  // Reads what happened to the connection. Returns why the daemon refuses it, as the end of a
  // sentence that begins with the daemon's name; empty if it does not.
  [[nodiscard]] std::string refusal();
  // As of the last call of refusal(): whether the connection stands, how many have ended, and how
  // many of those because the peer sent more than any daemon does.
  [[nodiscard]] bool established() const noexcept { return monitor_->established(); }
  [[nodiscard]] std::uint64_t ends() const noexcept { return monitor_->ends(); }
  [[nodiscard]] std::uint64_t cuts() const noexcept { return monitor_->cuts(); }

 private:
  DaemonSocket(Peer peer, net::Domain domain, net::Socket socket,
               std::unique_ptr<net::LinkMonitor> monitor)
      : peer_(std::move(peer)),
        domain_(domain),
        socket_(std::move(socket)),
        monitor_(std::move(monitor)) {}

  Peer peer_;
  net::Domain domain_;
  net::Socket socket_;
  std::unique_ptr<net::LinkMonitor> monitor_;  // ends before the socket
};

// When to open a socket anew. libzmq tries no more after a refusal, nor after a part that is too
// large or no ZMTP, and does not tell the latter from a loss; yet a key may be allowed later, and
// the port may be the daemon's again. One for each socket. Cold.
class Retry {
 public:
  // Each try costs the daemon a line in its log.
  static constexpr std::int64_t kPause_ns = 5 * kNanosPerSecond;

  // The daemon has refused the connection, or it has ended.
  void failed(std::int64_t now_ns, std::int64_t pause_ns = kPause_ns) {
    at_ns_ = now_ns + pause_ns;
  }
  void opened() noexcept { at_ns_.reset(); }
  [[nodiscard]] bool is_waiting() const noexcept { return at_ns_.has_value(); }
  // Whether to open the socket now. If that fails (a key file is being replaced, no descriptor is
  // free) it is due again after a pause. A connection that stands after all is left alone.
  [[nodiscard]] bool due(std::int64_t now_ns, bool established);

 private:
  std::optional<std::int64_t> at_ns_{};
};

}  // namespace posed::link
