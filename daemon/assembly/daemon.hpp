// Daemon: the composition of everything that `run`, `record`, `demo` and the tests start: devices,
// threads, rings, sockets. Open it (devices and models are loaded, sockets bound), start it, stop
// it. Cold, one owner thread.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/open_stream.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "drivers/driver.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"

namespace posed::assembly {

// What the daemon may be given when it starts; all of it outlives the daemon's stop().
struct DaemonHooks {
  pipeline::RecordSink* record_sink = nullptr;       // null: nothing is recorded
  std::function<void(v1::Stats&)> more_stats;        // what the recorder knows; may be empty
  std::function<void(const char* name)> hot_thread;  // first thing on a hot thread; may be empty
};

class Daemon {
 public:
  // Opens devices and models and binds the sockets. Errors name the stream.
  [[nodiscard]] static Result<std::unique_ptr<Daemon>> open(const config::DaemonConfig& config);
  ~Daemon();  // stops first
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  // In the order of the config; the index is the stream number everywhere.
  [[nodiscard]] std::span<const std::unique_ptr<devices::OpenStream>> streams() const noexcept;

  // Starts the threads and the devices. Call once.
  [[nodiscard]] Result<> start(DaemonHooks hooks = {});
  // Ends the threads: what was read is still decoded and published. May be called again.
  void stop() noexcept;

  // Valid after start(), from any thread.
  [[nodiscard]] const std::string& publish_endpoint() const noexcept;  // really bound
  [[nodiscard]] const std::string& control_endpoint() const noexcept;  // really bound
  [[nodiscard]] bool asked_to_stop() const noexcept;                   // by a control message
  // Every source that can end is finished and published; false when there is none.
  [[nodiscard]] bool all_ended() const noexcept;
  [[nodiscard]] v1::Stats stats() const;           // of the last second
  [[nodiscard]] bool wants_keys() const noexcept;  // CURVE on both sockets
  // Who may connect from now on; those who lost a right are cut off. Nothing without CURVE.
  void allow(const std::vector<net::AllowedClient>& clients);
  void post_event(std::uint32_t stream, v1::Event::Kind kind, const std::string& text);

 private:
  class Parts;
  explicit Daemon(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace posed::assembly
