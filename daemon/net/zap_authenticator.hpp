// ZapAuthenticator: the ZAP handler (ZeroMQ RFC 27) of a context. libzmq asks it at every
// handshake. With an allow-list it admits the keys that have the right for the socket's domain, and
// refuses all others. Without one (a daemon without keys) it admits every client of the daemon's
// sockets that speaks ZMTP 3 without a key.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>

#include "daemon/net/security.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {

// A request of libzmq to its ZAP handler (ZeroMQ RFC 27), read from the parts of its message.
struct ZapRequest {
  std::string id;                // returned in the reply
  std::string mechanism;         // "NULL", "CURVE", ...
  std::string key_z85;           // the client's public key; empty without CURVE or if it is no key
  std::optional<Domain> domain;  // of the socket; empty: of no socket of ours
};

// Parses the parts; empty if they are not a request of version 1.0.
[[nodiscard]] std::optional<ZapRequest> read_zap_request(std::span<const std::string> parts);

// Any thread may call any method; one thread of its own answers libzmq.
class ZapAuthenticator {
 public:
  // The handler's socket is bound before this returns. Start the authenticator before the first
  // socket of the context is made and destroy it after the last one is closed; otherwise a
  // handshake finds no handler and is refused.
  static Result<std::unique_ptr<ZapAuthenticator>> start(void* context,
                                                         std::optional<AccessList> list);
  ~ZapAuthenticator();
  ZapAuthenticator(const ZapAuthenticator&) = delete;
  ZapAuthenticator& operator=(const ZapAuthenticator&) = delete;

  // Returns whether the publisher must now disconnect subscribers that are no longer allowed; the
  // control socket checks every message (allows()). An authenticator without a list stays as it is.
  [[nodiscard]] bool replace(AccessList list);

  // Whether the peer whose message carries this User-Id still has the right; always true without a
  // list.
  [[nodiscard]] bool allows(std::string_view user_id, Domain domain) const;

  // Call when a peer was disconnected for what it sent. It will reconnect at once, and each
  // handshake costs a socket's thread some milliseconds: for the next second, handshakes are
  // answered one by one with a pause between them, in the order in which they come, so that
  // connected clients are not kept waiting.
  void slow_down() noexcept;

  // How many handshakes were refused so far.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_.load(); }

 private:
  ZapAuthenticator(Socket handler, Socket stop_in, Socket stop_out, std::optional<AccessList> list);
  void serve();
  void pause();
  void answer(Message& version);
  [[nodiscard]] bool welcomes(const ZapRequest& request) const;

  Socket handler_;   // REP on inproc://zeromq.zap.01, used by the thread
  Socket stop_in_;   // receives the stop message, used by the thread
  Socket stop_out_;  // sends the stop message
  mutable std::mutex mutex_;
  std::optional<AccessList> list_;  // under mutex_
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<std::int64_t> slow_until_ns_{0};
  std::thread thread_;
};

}  // namespace posed::net
