// Reader: the one thread that reads all devices, decodes their bytes and hands the frames to the
// pipeline thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/description_box.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/system/event_fd.hpp"
#include "daemon/system/moderation.hpp"
#include "drivers/driver.hpp"

namespace posed::pipeline {

// A body of a source on its way to the pipeline.
struct ReadBody {
  std::uint32_t stream = kNoStream;  // kNoStream: frames of this body are left out
  // The numbers of the body's frames and samples continue from these; null with kNoStream only.
  StreamCounters* counters = nullptr;
  // how many slots of ReaderPorts::out its frames, samples and events may fill at once
  std::size_t slots = std::numeric_limits<std::size_t>::max();
};

// The bodies of a source from now on, built by cold code.
struct SourceUpdate {
  std::shared_ptr<const drivers::SourceLayout> layout;  // null: of a device with one body
  std::vector<ReadBody> bodies;                         // [body]
  std::vector<std::byte> log;  // bytes of the log's description row (pipeline/description_row.hpp)
};

// What the reader and the cold thread that builds streams exchange about a source.
struct BodyExchange {
  // `describes`: the device has several bodies, and describes them.
  BodyExchange(system::EventFd& wakes_builder, bool describes) : builder(wakes_builder) {
    if (describes) descriptions.emplace(wakes_builder);
  }

  system::EventFd& builder;
  std::optional<DescriptionBox> descriptions;  // empty: a device with one body
  // The reader puts an update into `taken` once it uses it; the one before it is then free, and
  // the builder deletes it.
  Ring<const SourceUpdate*> updates{kUpdates}, taken{kUpdates};
  static constexpr std::size_t kUpdates = 4;
};

// Passes a device that may be unplugged between its supervisor (daemon/devices) and the reader.
// A device comes back once, also the one that the source began with: when its link is lost, or when
// the supervisor asks for it. While the reader is stopped none comes back.
struct DeviceSlot {
  Ring<drivers::Device*> in{kSlots}, out{kSlots};  // to and from the reader
  std::atomic<bool> give_back{false};              // the supervisor asks for the device in use
  std::unique_ptr<system::EventFd> supervisor;     // notified when `out` has something
  static constexpr std::size_t kSlots = 4;
};

// What the reader is connected to; all of it outlives the reader. `out`, `pipeline` and `clock` are
// required.
struct ReaderPorts {
  Ring<Item>* out = nullptr;
  system::EventFd* pipeline = nullptr;          // notified when `out` has something
  pipeline::RecordSink* record_sink = nullptr;  // null: no recording
  Clock clock = nullptr;
  Ring<DeviceCommand>* commands = nullptr;  // from control; may be null
};

// One source that the reader is to serve; what it points to outlives the reader.
struct ReadSource {
  drivers::Device* device = nullptr;  // null while it is unplugged
  SourceCounters* counters = nullptr;
  DeviceSlot* slot = nullptr;  // null: a device that cannot come back
  const drivers::glove::OwnedCalibration* calibration = nullptr;  // null: use the device's default
  std::optional<ReadBody> body{};    // of a device with one body: from the start on
  BodyExchange* exchange = nullptr;  // null: the source's bodies never change
};

class Reader {
 public:
  static Result<std::unique_ptr<Reader>> open(const ReaderPorts& ports);
  ~Reader();

  // Sources are numbered in the order in which they are added. Cold, before begin().
  void add(const ReadSource& source);

  // Starts to use the devices that add() gave; call before the first turn(), unless run() is used.
  // RT-safe, except for one epoll_ctl for each device.
  void begin() noexcept;
  // One round: applies commands, then reads a limited amount from each device that is due by the
  // clock or that run() found readable, so that none delays the others. Returns the latest time at
  // which the next turn is due [ns]; kForever_ns: only when call() was used or a device is ready.
  RT_SAFE std::int64_t turn(std::int64_t now_ns) noexcept;

  // begin(), then one turn after another until stop(). The calling thread becomes the reader
  // thread.
  void run() noexcept;
  void stop() noexcept;  // any thread
  // Of the thread in run(). Any thread.
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return pulse_; }
  // Wakes the reader because a slot, the command ring or a BodyExchange has something. Any thread.
  void call() noexcept;

 private:
  class Source;
  Reader(const ReaderPorts& ports, std::unique_ptr<system::EventFd> wake,
         std::unique_ptr<system::Poller> poller);
  // Reads the sources that are due by the clock; returns when the next one is.
  std::int64_t serve_timed(std::int64_t now_ns) noexcept;
  // Those of slots, commands and bodies; false: some wait for space in the ring.
  bool handle_requests() noexcept;
  [[nodiscard]] bool called() const noexcept { return called_.load(std::memory_order_acquire); }

  ReaderPorts ports_;
  std::unique_ptr<system::EventFd> wake_;
  std::unique_ptr<system::Poller> poller_;
  // sources whose descriptors are readable; memory of the poller
  std::span<const std::uint32_t> ready_;
  std::vector<std::unique_ptr<Source>> sources_;
  std::uint64_t next_item_ = 1;  // the next Item::number
  bool requests_wait_ = false;   // for space in `out`
  std::atomic<bool> called_{false};
  std::uint64_t handled_ = 0;  // chunks that came at their device's own pace
  system::Moderation moderation_;
  system::Pulse pulse_;
  std::atomic<bool> stop_{false};
  std::int64_t turned_ns_ = kNoTime_ns;  // the last turn
};

}  // namespace posed::pipeline
