// Worker: the pipeline thread. It takes what the reader decoded, runs each stream's engine, applies
// commands at frame boundaries, ticks silent streams, skips frames that are too late, and hands the
// rest to the publisher.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/partner_routes.hpp"
#include "daemon/pipeline/raw_tap.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/system/event_fd.hpp"

namespace posed::pipeline {

class StreamContext;

// The streams of the worker. The cold side builds and owns them; they are lent to the worker by
// pointer, before it runs and while it does.
struct StreamExchange {
  StreamExchange(std::size_t slot_count, system::EventFd& wakes_builder)
      : slots(slot_count), builder(wakes_builder), coming(slot_count), gone(2 * slot_count) {}

  std::size_t slots;            // streams at once
  system::EventFd& builder;     // notified when `gone` has something
  Ring<StreamContext*> coming;  // at most one for each slot
  Ring<StreamContext*> gone;    // the worker does not use it any more
};

// The rings and event descriptors around the worker; all of them outlive it.
struct WorkerPorts {
  Ring<Item>* in = nullptr;
  Ring<Item>* out = nullptr;
  Ring<Command>* commands = nullptr;
  Ring<Ack>* acks = nullptr;
  system::EventFd* wake = nullptr;       // wakes this thread
  system::EventFd* publisher = nullptr;  // notified when `out` has something
  system::EventFd* control = nullptr;    // notified when `acks` has something; may be null
  StreamExchange* streams = nullptr;
  pipeline::RecordSink* record_sink = nullptr;
  FrameTap* frame_tap = nullptr;
  Clock clock = nullptr;
};

class Worker {
 public:
  static Result<std::unique_ptr<Worker>> open(const WorkerPorts& ports);
  ~Worker();

  // A stream for StreamExchange::coming. `rate_hz` is the nominal rate, 0 when unknown; `slots` is
  // how many slots of `out` the stream may fill. Cold, any thread.
  [[nodiscard]] std::unique_ptr<StreamContext> make_context(EngineOptions options, double rate_hz,
                                                            StreamCounters& counters,
                                                            std::size_t slots) const;

  // One round: commands, a bounded number of items, and the ticks that are due. Returns the latest
  // time at which the next turn is due [ns]; kForever_ns: only when a ring has something.
  RT_SAFE std::int64_t turn(std::int64_t now_ns) noexcept;
  // After the reader's last turn: handles all items that wait, then makes the stages emit what they
  // hold back.
  RT_SAFE void finish() noexcept;

  // One turn after another until stop(), then finish(). The calling thread becomes the pipeline
  // thread.
  void run() noexcept;
  void stop() noexcept;  // any thread
  // Of the thread in run(). Any thread.
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return pulse_; }

 private:
  Worker(const WorkerPorts& ports, std::unique_ptr<system::Poller> poller);
  void apply_commands() noexcept;
  void handle_items(int most) noexcept;
  void handle(const Item& item) noexcept;
  void handle(const Item& item, StreamContext& context) noexcept;
  void accept_streams() noexcept;
  [[nodiscard]] StreamContext* find(std::uint32_t stream) noexcept;
  void put(std::uint32_t slot, StreamContext& context) noexcept;
  void give_back(StreamContext& context, const StreamEvent& end) noexcept;
  void acknowledge(const Ack& ack) noexcept;
  void send_acks() noexcept;
  [[nodiscard]] std::int64_t next_due_ns(std::int64_t now_ns) const noexcept;
  void tick(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool idle() const noexcept;

  WorkerPorts ports_;
  std::unique_ptr<system::Poller> poller_;
  std::vector<StreamContext*> contexts_;  // by slot; null where there is none
  std::vector<StreamContext*> coming_;    // by slot: follow when the slot is free
  PartnerRoutes routes_;                  // to the streams in contexts_
  std::uint64_t position_ = 1;  // number of the item before which a decision made now takes effect
  std::uint64_t handled_ = 0;   // of the item that is handled, or of the last one
  // Acks for which the ring was full; never more than there are commands under way.
  std::array<Ack, kMaxUnderWay> unsent_{};
  std::size_t unsent_count_ = 0;
  system::Pulse pulse_;
  std::atomic<bool> stop_{false};
};

// How many frames of one stream may wait before the oldest are skipped: 50 ms of them, at least 3.
[[nodiscard]] std::uint64_t shed_depth(double rate_hz) noexcept;

}  // namespace posed::pipeline
