// DeviceSupervisor manages one device that may be unplugged. While the device is absent, its thread
// tries to open it again and again; then it hands the device to the reader, and takes it back when
// the link is lost or the device falls silent. Cold: everything slow about a device (finding,
// start-up exchange, closing) happens here, so that no other stream is delayed.
#pragma once

#include <array>
#include <atomic>
#include <bitset>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "daemon/devices/open_source.hpp"
#include "daemon/pipeline/reader.hpp"
#include "drivers/transport/cold_writer.hpp"
#include "drivers/transport/hotplug_monitor.hpp"
#include "drivers/transport/upkeep.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::devices {

struct SupervisorPorts {
  pipeline::Reader* reader = nullptr;  // notified by call() when the slot has something
  Clock clock = nullptr;
  // Publishes an event on event/<stream>; must be callable from any thread.
  std::function<void(v1::Event::Kind kind, const std::string& text)> report;
};

// Notices a link that is open and gives nothing: because nothing answers, or because what comes is
// of no use. Cold.
class UseWatch {
 public:
  // A new link.
  void restart(const pipeline::SourceCounters& counters, std::int64_t now_ns);
  // Returns what to tell people; each cause is told once a link. `asks`: the device has to answer.
  [[nodiscard]] std::string look(const pipeline::SourceCounters& counters, bool asks,
                                 std::int64_t now_ns);

 private:
  using Counts = std::array<std::uint64_t, kOutcomes>;
  static constexpr std::int64_t kEvery_ns = 3 * kNanosPerSecond;
  static constexpr std::size_t kNoAnswer = kOutcomes;
  static constexpr std::size_t kNone = kOutcomes + 1;
  [[nodiscard]] static Counts counts_of(const pipeline::SourceCounters& counters);
  [[nodiscard]] static std::size_t cause_of(const Counts& came, bool asks, bool used);

  Counts before_{};
  std::int64_t opened_ns_ = 0, since_ns_ = 0;
  bool packets_came_ = false, used_ = false;  // any, since the link is open; any of use
  std::bitset<kOutcomes + 1> told_;
};

class DeviceSupervisor {
 public:
  // Whether a stream's device may be unplugged and return; only such streams have a supervisor.
  [[nodiscard]] static bool wanted(const OpenSource& source);

  // Starts the thread, which opens the device as soon as it is there. `source` outlives the
  // supervisor.
  DeviceSupervisor(OpenSource& source, SupervisorPorts ports);
  ~DeviceSupervisor();  // call after the reader's thread has ended; stops the thread first
  DeviceSupervisor(const DeviceSupervisor&) = delete;
  DeviceSupervisor& operator=(const DeviceSupervisor&) = delete;

  // Asks the thread to end, even during a device's start-up exchange. Returns at once; any thread.
  void stop() noexcept;

 private:
  void run();
  void take_back();
  void watch_silence();
  void write_to_device();
  void look_for_device();
  Result<std::unique_ptr<drivers::Device>> try_open();
  void keep_up();
  void watch_use();
  void sleep();
  [[nodiscard]] bool settling() const;  // a device node appeared a moment ago

  OpenSource& source_;
  SupervisorPorts ports_;
  const drivers::Driver& driver_;
  drivers::HotplugMonitor hotplug_;
  std::unique_ptr<drivers::Device> device_;  // the open device; null while it is unplugged
  drivers::ColdWriter* writer_ = nullptr;    // the same device's writer, if writing to it blocks
  drivers::Upkeep* upkeep_ = nullptr;        // the same device's upkeep, if its link needs any
  std::uint64_t drops_reported_ = 0;         // of the writer
  UseWatch use_;
  bool away_ = true;
  bool found_once_ = false;
  bool asked_back_ = false;
  std::int64_t settled_ns_ = 0;  // when a device that just appeared should be ready to open
  std::string reported_;         // the last reported reason why it could not be opened
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace posed::devices
