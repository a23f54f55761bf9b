// Reader: the one thread that reads all devices, decodes what they sent and hands the frames to the
// pipeline thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/system/event_fd.hpp"
#include "drivers/driver.hpp"

namespace posed::pipeline {

// A device that may go and come: how its supervisor (daemon/devices) and the reader hand it over.
// Every device that went in comes back once, when its link is lost or it is asked for.
struct DeviceSlot {
  Ring<drivers::Device*> in{kSlots}, out{kSlots};  // to and from the reader
  std::atomic<bool> give_back{false};              // the supervisor wants the device that is in use
  std::unique_ptr<system::EventFd> supervisor;     // rung when there is something in `out`
  static constexpr std::size_t kSlots = 4;
};

// What the reader needs of its surroundings; all of it outlives the reader.
struct ReaderPorts {
  Ring<Item>* out = nullptr;
  system::EventFd* pipeline = nullptr;          // rung when there is something in `out`
  pipeline::RecordSink* record_sink = nullptr;  // null: nothing is recorded
  Clock clock = nullptr;
  Ring<DeviceCommand>* commands = nullptr;  // from control; may be null
};

// One stream as the reader takes it over; what it points to outlives the reader.
struct ReadStream {
  drivers::Device* device = nullptr;  // null while it is away
  StreamCounters* counters = nullptr;
  DeviceSlot* slot = nullptr;  // null: a device that never comes back
  const drivers::glove::OwnedCalibration* calibration = nullptr;  // null: the device's default
  std::size_t slots = std::numeric_limits<std::size_t>::max();    // of `out` that it may fill
};

class Reader {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Reader>> open(const ReaderPorts& ports);
  ~Reader();

  // Streams are numbered in the order of adding. Cold, before run().
  void add(const ReadStream& stream);

  // Takes the first devices over; before the first turn. RT-safe but for one epoll_ctl a device.
  void begin() noexcept;
  // One round: obeys commands, and reads a share of what each device has sent, so that none of them
  // keeps the others waiting. Returns when the next turn is due at the latest [ns]; kForever_ns:
  // when called or when a device is ready. RT-safe.
  std::int64_t turn(std::int64_t now_ns) noexcept;

  // begin(), then turn after turn until stop(). The calling thread becomes the reader thread.
  void run() noexcept;
  void stop() noexcept;  // any thread
  // There is something in a slot or in the commands. Any thread.
  void call() noexcept;

 private:
  class Source;
  Reader(const ReaderPorts& ports, std::unique_ptr<system::EventFd> wake,
         std::unique_ptr<system::Poller> poller);
  // Reads what is due by the clock; returns when that is the case next.
  std::int64_t serve_timed(std::int64_t now_ns) noexcept;
  bool take_requests() noexcept;  // slots and commands; false: some must wait for room in the ring
  [[nodiscard]] bool called() const noexcept { return called_.load(std::memory_order_acquire); }

  ReaderPorts ports_;
  std::unique_ptr<system::EventFd> wake_;
  std::unique_ptr<system::Poller> poller_;
  std::span<const std::uint32_t> ready_;  // sources whose descriptors have something; the poller's
  std::vector<std::unique_ptr<Source>> sources_;
  std::uint64_t next_item_ = 1;  // Item::number
  bool commands_wait_ = false;   // for room in `out`
  std::atomic<bool> called_{false};
  std::atomic<bool> stop_{false};
};

}  // namespace posed::pipeline
