// TriggerServer: the UDP socket of the trigger, and its cold thread. Datagrams are not
// authenticated: it obeys only those of `peers` or, without peers, of this machine; others are
// counted.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/control/trigger.hpp"
#include "daemon/system/event_fd.hpp"
#include "drivers/transport/address.hpp"
#include "proto/frame/result.hpp"

namespace posed::control {

class TriggerServer {
 public:
  // `listen` and `peers` as in the config; without peers `listen` must be loopback, anything else
  // is an error. Binds and starts the thread; `daemon_control` outlives the server. Broadcasts are
  // received where `listen` is 0.0.0.0.
  static Result<std::unique_ptr<TriggerServer>> start(const std::string& listen,
                                                      const std::vector<std::string>& peers,
                                                      DaemonControl& daemon_control);
  ~TriggerServer();
  TriggerServer(const TriggerServer&) = delete;
  TriggerServer& operator=(const TriggerServer&) = delete;

  static constexpr const char* kThreadName = "posed-trigger";
  // Any thread.
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return pulse_; }

 private:
  TriggerServer(int fd, std::unique_ptr<system::EventFd> wake, drivers::Peers peers,
                DaemonControl& daemon_control);
  void serve();
  // Returns false if none waits.
  [[nodiscard]] bool handle_datagram();

  int fd_;
  std::unique_ptr<system::EventFd> wake_;
  drivers::Peers peers_;
  Trigger trigger_;
  std::uint64_t strangers_ = 0;  // datagrams of others
  system::Pulse pulse_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace posed::control
