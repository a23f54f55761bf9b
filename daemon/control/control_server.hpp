// ControlServer: the ROUTER socket and its cold thread. Each message is one request. Parts before
// the last one are returned before the reply, so that a client may number its requests. Nothing
// that a client does or fails to do makes another client wait.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "daemon/control/request_handler.hpp"
#include "daemon/net/peer_guard.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::control {

// What the server is connected to; all of it outlives the server.
struct ControlPorts {
  pipeline::Ring<pipeline::Ack>* acks = nullptr;  // consumed by the server's thread
  system::EventFd* wake = nullptr;                // notified when `acks` has something
  // Checks every client; null (in tests): all are admitted, even with ZMTP before 3.0.
  net::ZapAuthenticator* authenticator = nullptr;
  std::string secret_z85;  // the server's key; empty: no CURVE
};

// Since the start.
struct ControlCounts {
  std::uint64_t requests = 0;
  std::uint64_t refusals = 0;  // of them
};

class ControlServer {
 public:
  // Binds and starts the thread. `handler` outlives the server.
  static Result<std::unique_ptr<ControlServer>> start(void* context, const std::string& endpoint,
                                                      const ControlPorts& ports,
                                                      RequestHandler& handler);
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

  static constexpr const char* kThreadName = "posed-control";
  // Any thread.
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return handler_.pulse(); }
  [[nodiscard]] ControlCounts counts() const noexcept {
    return {.requests = requests_.load(), .refusals = refusals_.load()};
  }
  // Of the clients.
  [[nodiscard]] const net::PeerGuard& guard() const noexcept { return *guard_; }
  // the endpoint that is really bound
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }

 private:
  ControlServer(net::Socket router, std::unique_ptr<net::PeerGuard> guard, std::string endpoint,
                const ControlPorts& ports, RequestHandler& handler);
  void serve();
  void sleep(long longest_ms);
  [[nodiscard]] bool handle_request();
  [[nodiscard]] bool handle_ack();
  void send(const Reply& reply);

  net::Socket router_;
  std::unique_ptr<net::PeerGuard> guard_;
  std::string endpoint_;
  ControlPorts ports_;
  RequestHandler& handler_;
  std::atomic<std::uint64_t> requests_{0}, refusals_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace posed::control
