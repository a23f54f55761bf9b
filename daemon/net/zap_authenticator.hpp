// ZapAuthenticator: the ZAP handler (ZeroMQ RFC 27) of a context. Every handshake asks it. With an
// allow-list it lets in the keys that have the right for the socket's domain, and nobody else.
// Without one (a daemon without keys) whoever speaks ZMTP 3 without a key is welcome.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include "daemon/net/security.hpp"
#include "daemon/net/zap_request.hpp"
#include "daemon/net/zmq_handle.hpp"

namespace posed::net {

class ZapAuthenticator {
 public:
  // Bound before it returns. Start it before the first socket of the context is made and destroy it
  // after the last is closed, else a handshake finds nobody to ask (and is refused).
  [[nodiscard]] static Result<std::unique_ptr<ZapAuthenticator>> start(
      void* context, std::optional<AccessList> list);
  ~ZapAuthenticator();
  ZapAuthenticator(const ZapAuthenticator&) = delete;
  ZapAuthenticator& operator=(const ZapAuthenticator&) = delete;

  // What a new list means for those already connected. ROUTER messages are checked one by one
  // (allows), so the control socket needs nothing; the publisher must cut the subscribers off that
  // are not allowed any more.
  struct Change {
    bool publisher_must_check = false;
  };
  [[nodiscard]] Change replace(AccessList list);  // a authenticator without a list stays as it is

  // Whether the peer whose message carries this User-Id still has the right; always without a list.
  [[nodiscard]] bool allows(std::string_view user_id, Domain domain) const;

  // A peer was cut off for what it sent. It will be back at once, and each time it costs a socket's
  // thread some milliseconds: for the next second handshakes are answered one by one with a pause
  // between them, in the order of their coming, so that whoever is connected is not kept waiting.
  // Any thread.
  void slow_down() noexcept;

  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_.load(); }

 private:
  ZapAuthenticator(Socket door, Socket stop_in, Socket stop_out, std::optional<AccessList> list);
  void serve();
  void pause();
  void answer(Message& version);
  [[nodiscard]] bool welcomes(const ZapRequest& request) const;

  Socket door_;      // REP on inproc://zeromq.zap.01, the thread's
  Socket stop_in_;   // the thread's end of the bell that ends it
  Socket stop_out_;  // ours
  mutable std::mutex mutex_;
  std::optional<AccessList> list_;  // under mutex_
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<std::int64_t> slow_until_ns_{0};
  std::thread thread_;
};

}  // namespace posed::net
