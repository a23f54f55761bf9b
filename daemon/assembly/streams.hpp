// Streams: the sources of the running daemon and their streams. It hands what the SourceBuilder
// makes to log, publisher, control and worker, and takes it back from them; and it owns the
// devices' supervisors and the thread of the builder, which runs where a source has several bodies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/control/request_handler.hpp"
#include "daemon/devices/device_supervisor.hpp"
#include "daemon/devices/kept_settings.hpp"
#include "daemon/devices/source_builder.hpp"
#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/stream_context.hpp"
#include "daemon/pipeline/worker.hpp"
#include "daemon/publish/publisher.hpp"

namespace posed::assembly {

// The parts of the daemon that know streams. Nothing uses them after stop().
struct StreamUsers {
  publish::Publisher* publisher = nullptr;
  control::RequestHandler* handler = nullptr;
  pipeline::Worker* worker = nullptr;
  pipeline::Reader* reader = nullptr;
  std::function<void(const devices::NewStream&)> record;  // before its first item; may be empty
};

class Streams final : public devices::StreamHost {
 public:
  static constexpr const char* kThreadName = "posed-bodies";

  // Opens the sources, those of the [[stream]] tables with a device first, and builds the streams
  // of devices with one body.
  static Result<std::unique_ptr<Streams>> open(const config::DaemonConfig& config);
  ~Streams() override;  // call after stop()

  // By number.
  [[nodiscard]] const std::vector<std::unique_ptr<devices::OpenSource>>& sources() const {
    return sources_;
  }
  [[nodiscard]] std::size_t slots() const { return slots_; }  // streams at once
  // Slots of the rings that all streams may fill together, with one for the end of each.
  [[nodiscard]] std::size_t decoded_slots() const { return decoded_slots_; }
  [[nodiscard]] std::size_t finished_slots() const { return finished_slots_; }
  [[nodiscard]] double messages_per_s() const {
    return messages_per_s_;
  }  // at most, of all streams
  [[nodiscard]] pipeline::StreamExchange& exchange() { return *exchange_; }
  [[nodiscard]] devices::KeptSettings& kept() { return kept_; }

  // Makes the streams of devices with one body known to all, and adds the sources to the reader.
  // Call before the threads of the users run.
  void begin(StreamUsers users);
  // Starts the devices, the builder and the supervisors.
  Result<> start();
  // Ends looking for devices; returns at once.
  void stop_supervisors() noexcept;
  // After the reader has ended: ends the threads.
  void stop() noexcept;

  // Any thread, after begin().
  struct Counts {
    std::size_t live = 0, all = 0;
  };
  [[nodiscard]] Counts counts() const;  // of the streams that are there now
  // Those that the config names, and the others that are there now.
  [[nodiscard]] std::vector<std::string> names() const;
  // The counters of a stream that is there now.
  [[nodiscard]] const pipeline::StreamCounters& counters_of(std::uint32_t stream) const {
    return counters_[pipeline::slot_of(stream)];
  }
  // Of the builder's thread; null if there is none.
  [[nodiscard]] const system::Pulse* pulse() const noexcept { return several_ ? &pulse_ : nullptr; }

 private:
  explicit Streams(const config::DaemonConfig& config) : config_(config) {}
  Result<> open_sources();
  Result<> open_source(config::SourceConfig config);
  void make_room();
  Result<> open_builder();
  void run();
  // An event of a source, on all of its streams; only in the daemon's own log while it has none.
  void report(const devices::OpenSource& source, v1::Event::Kind kind, const std::string& text);

  // StreamHost
  void is_alive() noexcept override { pulse_.beat(); }
  pipeline::StreamCounters& counters(std::uint32_t stream) override {
    return counters_[pipeline::slot_of(stream)];
  }
  void add(devices::NewStream stream) override;
  std::optional<std::uint32_t> next_gone() override;
  void remove(std::uint32_t stream) override;
  void call_reader() override { users_.reader->call(); }
  void warn(const devices::OpenSource& source, const std::string& sentence) override {
    report(source, v1::Event::KIND_WARNING, sentence);
  }

  struct There {
    const devices::OpenSource* source = nullptr;
    std::string name;
  };

  const config::DaemonConfig& config_;
  devices::ModelFiles models_;
  devices::KeptSettings kept_;
  std::vector<std::unique_ptr<devices::OpenSource>> sources_;
  bool several_ = false;  // a source has several bodies
  std::size_t slots_ = 0, decoded_slots_ = 0, finished_slots_ = 0;
  double messages_per_s_ = 0.0;
  std::unique_ptr<system::EventFd> wake_;
  std::unique_ptr<system::Poller> poller_;
  std::unique_ptr<pipeline::StreamExchange> exchange_;
  std::unique_ptr<pipeline::StreamCounters[]> counters_;  // by slot
  StreamUsers users_;
  std::unique_ptr<devices::SourceBuilder> builder_;
  std::map<std::uint32_t, std::unique_ptr<pipeline::StreamContext>> contexts_;  // by stream
  mutable std::mutex mutex_;                                                    // guards there_
  std::map<std::uint32_t, There> there_;                                        // by stream
  std::vector<std::unique_ptr<devices::DeviceSupervisor>> supervisors_;
  system::Pulse pulse_;
  std::thread thread_;
};

}  // namespace posed::assembly
