// DeviceSupervisor: holds on to one device. Its thread opens the device when it is away, again and
// again until it is there, hands it to the reader, and takes it back when its link is lost or it
// falls silent. Cold: everything slow about a device (finding, start-up talk, closing) happens
// here, so that no other stream events.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "daemon/devices/open_stream.hpp"
#include "daemon/pipeline/reader.hpp"
#include "drivers/transport/cold_writer.hpp"
#include "drivers/transport/hotplug_monitor.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::devices {

struct SupervisorPorts {
  pipeline::Reader* reader = nullptr;  // called when the slot has something
  Clock clock = nullptr;
  // Tells on event/<stream>; any thread.
  std::function<void(v1::Event::Kind kind, const std::string& text)> report;
};

class DeviceSupervisor {
 public:
  // Whether a stream's device can go and come; only such streams have a supervisor.
  [[nodiscard]] static bool wanted(const devices::OpenStream& stream);

  // Starts the thread, which opens the device as soon as it is there. `stream` outlives the
  // supervisor.
  DeviceSupervisor(devices::OpenStream& stream, SupervisorPorts ports);
  ~DeviceSupervisor();  // after the reader's thread has ended; stops first
  DeviceSupervisor(const DeviceSupervisor&) = delete;
  DeviceSupervisor& operator=(const DeviceSupervisor&) = delete;

  // Tells the thread to end, a device's start-up talk included. Returns at once; any thread.
  void stop() noexcept;

 private:
  void run();
  void take_back();
  void watch_silence();
  void write_to_device();
  void look_for_device();
  [[nodiscard]] Result<std::unique_ptr<drivers::Device>> try_open();
  void sleep();
  [[nodiscard]] bool settling() const;  // a node has come a moment ago

  devices::OpenStream& stream_;
  SupervisorPorts ports_;
  const drivers::Driver& driver_;
  drivers::HotplugMonitor hotplug_;
  std::unique_ptr<drivers::Device> device_;  // the one opened here; null while it is away
  drivers::ColdWriter* writer_ = nullptr;    // its other side, where writing to it blocks
  std::uint64_t drops_reported_ = 0;         // of the writer
  bool away_ = true;
  bool found_once_ = false;
  bool asked_back_ = false;
  std::int64_t settled_ns_ = 0;  // when what came last should open
  std::string reported_;         // why it could not be opened, as last told
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace posed::devices
