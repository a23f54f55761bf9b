// Daemon: builds and owns everything that `run`, `record`, `demo` and the tests start: devices,
// threads, rings, sockets. Open it (loads devices and models, binds sockets), start it, stop it.
// Cold, one owner thread.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/stream_host.hpp"
#include "daemon/metrics/figures.hpp"
#include "daemon/pipeline/raw_tap.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/system/pulse.hpp"
#include "drivers/driver.hpp"
#include "posed/v1/control.pb.h"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"

namespace posed::assembly {

// Optional extras for start(); all of them outlive the daemon's stop().
struct DaemonHooks {
  pipeline::RecordSink* record_sink = nullptr;  // null: no recording
  // Called for each stream before its first item, at the start or while the daemon runs; may be
  // empty.
  std::function<void(const devices::NewStream&)> record_stream{};
  pipeline::FrameTap* frame_tap = nullptr;  // null: nobody else wants the finished frames
  // Adds the clips of takes that are not there (yet) to a list of recordings; may be empty.
  std::function<void(v1::ControlReply&)> add_clips{};
  std::function<void(v1::Stats&)> more_stats;  // adds the recorder's counters; may be empty
  // The same for metrics; may be empty.
  std::function<metrics::RecorderFigures()> recorder_figures{};
  // called first on each hot thread; may be empty
  std::function<void(const char* name)> hot_thread;
};

class Daemon {
 public:
  // Opens devices and models and binds the sockets. Errors name the stream.
  static Result<std::unique_ptr<Daemon>> open(const config::DaemonConfig& config);
  ~Daemon();  // stops the daemon first
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  // By number: those of the [[stream]] tables with a device, whose streams have the same number,
  // then those of the [[source]] tables, each in the order of the config.
  [[nodiscard]] std::span<const std::unique_ptr<devices::OpenSource>> sources() const noexcept;
  [[nodiscard]] std::size_t slots() const noexcept;  // how many streams there may be at once

  // Starts the threads and the devices. Call once.
  Result<> start(DaemonHooks hooks = {});
  // Ends the threads; everything that was read is still decoded and published. May be called again.
  void stop() noexcept;

  // Valid after start(), from any thread.
  // the one that is really bound
  [[nodiscard]] const std::string& publish_endpoint() const noexcept;
  // the one that is really bound
  [[nodiscard]] const std::string& control_endpoint() const noexcept;
  // "http://127.0.0.1:5572/metrics"; empty: the config has no [metrics].
  [[nodiscard]] std::string metrics_url() const;
  [[nodiscard]] bool asked_to_stop() const noexcept;  // by a control message
  // The names of the streams that the config names, and of the others that are there now.
  [[nodiscard]] std::vector<std::string> stream_names() const;
  struct StreamCounts {
    std::size_t live = 0, all = 0;
  };
  // Of the streams that are there now. Asks no thread.
  [[nodiscard]] StreamCounts stream_counts() const;
  // Whether every source that can end has ended and been published; false if there is none.
  [[nodiscard]] bool all_ended() const noexcept;
  [[nodiscard]] v1::Stats stats() const;           // as of the last second
  [[nodiscard]] bool wants_keys() const noexcept;  // CURVE on both sockets
  // Replaces the list of clients that may connect; clients that lost a right are disconnected. Has
  // no effect without CURVE.
  void allow(const std::vector<net::AllowedClient>& clients);
  void post_event(std::uint32_t stream, v1::Event::Kind kind, const std::string& text);
  // Of the threads that must not get stuck; valid until the destructor.
  [[nodiscard]] std::vector<system::ThreadPulse> pulses() const;

 private:
  class Parts;
  explicit Daemon(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace posed::assembly
