// PublishSocket: an XPUB socket for untrusted subscribers, as the daemon and the relay have one. It
// knows who is connected, limits what they subscribe to, and cuts the connection of one that
// exceeds a limit. A subscriber that reads too slowly loses messages, and only that one. One thread
// uses it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/publish/subscriptions.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {
class ZapAuthenticator;
class PeerGuard;
}  // namespace posed::net

namespace posed::publish {

// The length of a message queue that holds a quarter of a second of all streams together.
[[nodiscard]] int send_high_water_mark(double messages_per_s);
// Sets that queue length, and a small kernel buffer behind it. Call before bind.
Result<> set_queue_options(void* socket, double messages_per_s);

struct PublishSocketSettings {
  void* context = nullptr;  // the ZeroMQ context; outlives the socket
  std::string endpoint;
  // Checks every subscriber; null (in tests): all are admitted, even with ZMTP before 3.0.
  net::ZapAuthenticator* authenticator = nullptr;
  std::string secret_z85;       // the server's key; empty: no CURVE
  double messages_per_s = 0.0;  // of all topics together, for the length of the queues
};

class PublishSocket {
 public:
  // Binds.
  static Result<PublishSocket> open(const PublishSocketSettings& settings);
  ~PublishSocket();
  PublishSocket(PublishSocket&&) noexcept;
  PublishSocket& operator=(PublishSocket&&) = delete;

  [[nodiscard]] void* get() const noexcept { return socket_.get(); }
  [[nodiscard]] const std::string& endpoint() const noexcept { return endpoint_; }  // really bound
  // Any thread may use the guard.
  [[nodiscard]] net::PeerGuard& guard() const noexcept { return *guard_; }

  // Hears subscriptions, at most 64, and keeps `subscriptions` up to date. Calls `subscribed` with
  // the prefix of each new one that is within the limits. Returns false if more may wait.
  [[nodiscard]] bool receive_subscriptions(
      Subscriptions& subscriptions, std::int64_t now_ns,
      const std::function<void(std::string_view prefix)>& subscribed);

 private:
  PublishSocket(net::Socket socket, std::unique_ptr<net::PeerGuard> guard, std::string endpoint);

  net::Socket socket_;
  std::unique_ptr<net::PeerGuard> guard_;  // ends before the socket
  std::string endpoint_;
};

}  // namespace posed::publish
