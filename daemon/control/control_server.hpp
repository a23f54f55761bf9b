// ControlServer: the ROUTER socket and the cold thread behind it. One request a message; whatever
// parts stand before the last one come back before the reply, so that a client may number its
// requests. Nothing a client does, or leaves undone, makes anyone wait.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "daemon/control/request_handler.hpp"
#include "daemon/net/peer_guard.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/net/zmq_handle.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/system/event_fd.hpp"

namespace posed::control {

// All of it outlives the server.
struct ControlPorts {
  pipeline::Ring<pipeline::Ack>* acks = nullptr;  // this thread consumes
  system::EventFd* wake = nullptr;                // rung when there is something in `acks`
  // Asked about every client; null (in tests): nobody is asked, and old ZMTP is spoken, too.
  net::ZapAuthenticator* authenticator = nullptr;
  std::string secret_z85;  // the server's key; empty: no CURVE
};

class ControlServer {
 public:
  // Binds and starts the thread. Only the thread touches `handler` until the destructor returns.
  [[nodiscard]] static Result<std::unique_ptr<ControlServer>> start(void* context,
                                                                    const std::string& endpoint,
                                                                    const ControlPorts& ports,
                                                                    RequestHandler& handler);
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }  // really bound

 private:
  ControlServer(net::Socket router, std::unique_ptr<net::PeerGuard> guard, std::string endpoint,
                const ControlPorts& ports, RequestHandler& handler);
  void serve();
  void sleep(long longest_ms);  // negative: until something comes
  [[nodiscard]] bool take_request();
  [[nodiscard]] bool take_ack();
  void send(const Reply& answer);

  net::Socket router_;
  std::unique_ptr<net::PeerGuard> guard_;
  std::string endpoint_;
  ControlPorts ports_;
  RequestHandler& handler_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace posed::control
