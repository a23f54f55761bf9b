// Worker: the pipeline thread. It takes what the reader decoded, runs each stream's engine, applies
// commands at frame boundaries, ticks silent streams, skips frames that are too late, and hands the
// rest to the publisher.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/system/event_fd.hpp"

namespace posed::pipeline {

// The rings and event descriptors around the worker; all of them outlive it.
struct WorkerPorts {
  Ring<Item>* in = nullptr;
  Ring<Item>* out = nullptr;
  Ring<Command>* commands = nullptr;
  Ring<Ack>* acks = nullptr;
  system::EventFd* wake = nullptr;       // wakes this thread
  system::EventFd* publisher = nullptr;  // notified when `out` has something
  system::EventFd* control = nullptr;    // notified when `acks` has something; may be null
  pipeline::RecordSink* record_sink = nullptr;
  Clock clock = nullptr;
};

class Worker {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Worker>> open(const WorkerPorts& ports);
  ~Worker();

  // Streams are numbered in the order in which they are added. `rate_hz` is the nominal rate, 0
  // when unknown; `slots` is how many slots of `out` the stream may fill. Cold, before the first
  // turn.
  void add(EngineOptions options, double rate_hz, StreamCounters& counters,
           std::size_t slots = std::numeric_limits<std::size_t>::max());

  // One round: commands, a bounded number of items, and the ticks that are due. Returns the latest
  // time at which the next turn is due [ns]; kForever_ns: only when a ring has something. RT-safe.
  std::int64_t turn(std::int64_t now_ns) noexcept;
  // After the reader's last turn: handles all items that wait, then makes the stages emit what they
  // hold back. RT-safe.
  void finish() noexcept;

  // One turn after another until stop(), then finish(). The calling thread becomes the pipeline
  // thread.
  void run() noexcept;
  void stop() noexcept;  // any thread

  // Call after run() has returned.
  [[nodiscard]] const StreamEngine& engine(std::uint32_t stream) const;

 private:
  struct StreamContext;
  Worker(const WorkerPorts& ports, std::unique_ptr<system::Poller> poller);
  void apply_commands() noexcept;
  void take_items(int most) noexcept;
  void take(const Item& item) noexcept;
  void acknowledge(const Ack& ack) noexcept;
  void send_acks() noexcept;
  [[nodiscard]] std::int64_t next_due_ns(std::int64_t now_ns) const noexcept;
  void pass_on(const StreamEvent& event, StreamContext& context) noexcept;
  void tick(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool idle() const noexcept;

  WorkerPorts ports_;
  std::unique_ptr<system::Poller> poller_;
  std::vector<std::unique_ptr<StreamContext>> contexts_;
  std::uint64_t position_ = 1;  // number of the item before which a decision made now takes effect
  // Acks for which the ring was full; never more than there are commands under way.
  std::array<Ack, kMaxUnderWay> unsent_{};
  std::size_t unsent_count_ = 0;
  std::atomic<bool> stop_{false};
};

// How many frames of one stream may wait before the oldest are skipped: 50 ms of them, at least 3.
[[nodiscard]] std::uint64_t shed_depth(double rate_hz) noexcept;

}  // namespace posed::pipeline
