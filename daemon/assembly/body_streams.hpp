// BodyStreams: the streams of devices with several bodies in the running daemon. It hands what the
// SourceBuilder makes to log, publisher, control and worker, and takes it back from them; and it
// owns the thread of the builder.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "daemon/control/request_handler.hpp"
#include "daemon/devices/device_supervisor.hpp"
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
  pipeline::PartnerStreams partners{};                    // that stages may name
  std::function<void(const devices::NewStream&)> record;  // before its first item; may be empty
};

class BodyStreams final : public devices::StreamHost {
 public:
  static constexpr const char* kThreadName = "posed-bodies";

  // Opens the sources. Null if the config has none. `first` is the number of the first source and
  // the slot of the first stream, behind those of the one-body devices.
  [[nodiscard]] static Result<std::unique_ptr<BodyStreams>> open(const config::DaemonConfig& config,
                                                                 std::uint32_t first);
  ~BodyStreams() override;  // call after stop()

  // Slots of the rings that the streams may fill together.
  [[nodiscard]] std::size_t all_decoded_slots() const { return count_ * decoded_slots_; }
  [[nodiscard]] std::size_t all_finished_slots() const { return count_ * finished_slots_; }
  [[nodiscard]] std::size_t count() const { return count_; }               // streams at once
  [[nodiscard]] double messages_per_s() const { return messages_per_s_; }  // of all of them
  [[nodiscard]] pipeline::StreamExchange& exchange() { return *exchange_; }
  [[nodiscard]] const std::vector<std::unique_ptr<devices::BodySource>>& sources() const {
    return sources_;
  }

  // Adds the sources to the reader. Call before the reader runs.
  void add_to(pipeline::Reader& reader);
  // Starts the devices, the builder and the supervisors. `reserved` are names that no body may get.
  [[nodiscard]] Result<> start(StreamUsers users, std::set<std::string> reserved);
  // Ends looking for devices; returns at once.
  void stop_supervisors() noexcept;
  // After the reader has ended: ends the threads.
  void stop() noexcept;
  // Of the builder's thread.
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return pulse_; }

 private:
  BodyStreams() = default;
  [[nodiscard]] Result<> open_source(const config::SourceConfig& config, std::uint32_t number);
  void run();
  // An event of a source, on all of its streams; only in the daemon's own log while it has none.
  void report(const devices::BodySource& source, v1::Event::Kind kind, const std::string& text);

  // StreamHost
  pipeline::StreamCounters& counters(std::uint32_t stream) override;
  [[nodiscard]] std::size_t decoded_slots() const override { return decoded_slots_; }
  void add(devices::NewStream stream) override;
  std::optional<std::uint32_t> take_gone() override;
  void remove(std::uint32_t stream) override;
  void call_reader() override { users_.reader->call(); }
  void warn(const devices::BodySource& source, const std::string& sentence) override {
    report(source, v1::Event::KIND_WARNING, sentence);
  }

  devices::ModelFiles models_;
  std::vector<std::unique_ptr<devices::BodySource>> sources_;
  std::uint32_t first_ = 0;  // slot
  std::size_t count_ = 0;
  std::size_t decoded_slots_ = 0, finished_slots_ = 0;  // of one stream
  double messages_per_s_ = 0.0;                         // of all of them
  std::unique_ptr<system::EventFd> wake_;
  std::unique_ptr<system::Poller> poller_;
  std::unique_ptr<pipeline::StreamExchange> exchange_;
  std::unique_ptr<pipeline::StreamCounters[]> counters_;  // by slot, from first_ on
  StreamUsers users_;
  std::unique_ptr<devices::SourceBuilder> builder_;
  std::map<std::uint32_t, std::unique_ptr<pipeline::StreamContext>> contexts_;  // by stream
  std::mutex mutex_;                                                            // guards source_of_
  std::map<std::uint32_t, const devices::BodySource*> source_of_;               // by stream
  std::vector<std::unique_ptr<devices::DeviceSupervisor>> supervisors_;
  system::Pulse pulse_;
  std::thread thread_;
};

}  // namespace posed::assembly
