// StreamContext: one stream in the worker: its engine, and the place where the engine's output
// goes. Cold code builds it whole; from then on only the pipeline thread uses it, and all calls are
// RT-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/partner_routes.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/pipeline/worker.hpp"

namespace posed::pipeline {

class StreamContext final : private EngineOut {
 public:
  // `slots` is how many slots of the ring to the publisher the stream may fill. `ports`, `routes`,
  // `next_item`, the number of the item before which a decision takes effect, and `handled_item`,
  // that of the item that is handled or was last, are the worker's.
  StreamContext(EngineOptions options, double rate_hz, StreamCounters& counters, std::size_t slots,
                const WorkerPorts& ports, const PartnerRoutes& routes,
                const std::uint64_t& next_item, const std::uint64_t& handled_item);

  [[nodiscard]] std::uint32_t stream() const noexcept { return stream_; }
  [[nodiscard]] const StreamEngine& engine() const noexcept { return engine_; }

  // Newest data wins: a frame that has shed_depth() or more newer frames waiting behind it is
  // skipped. The engine detects the gap at the next frame or tick. The same for samples.
  void frame(const Frame& frame) noexcept;
  void sample(const Sample& sample) noexcept;
  // The reader has ended the stream: it decoded nothing after the sequences of the event.
  void end(const StreamEvent& event) noexcept;
  // Passes on an event of the reader. It comes from the same ring as the frames, so it keeps its
  // place between them.
  void pass_on(const StreamEvent& event) noexcept;
  // Call after an item of the stream has been handled.
  void handled() noexcept;
  // The worker has the stream now, or not any more: what its partners publish comes here.
  void join(PartnerRoutes& routes) noexcept { routes.add(engine_, *this); }
  void leave(PartnerRoutes& routes) const noexcept { routes.remove(engine_); }

  // What the stages are to do from the first item on. Cold, before the worker has the object.
  void set_first_commands(std::vector<Command> commands) { first_commands_ = std::move(commands); }
  // Call before an item of the stream is handled.
  void begin() noexcept {
    for (; begun_ < first_commands_.size(); ++begun_) {
      static_cast<void>(apply(first_commands_[begun_]));
    }
  }

  [[nodiscard]] Ack apply(const Command& command) noexcept;
  void tick(std::int64_t now_ns) noexcept;
  // Nothing more comes from the reader: emits what the stages hold back.
  void flush() noexcept;
  // Takes over the slot of an earlier stream of the same name, with its part of the ring to the
  // publisher. `end` is the event that ended it.
  void follow(const StreamContext& earlier, const StreamEvent& end) noexcept {
    share_ = earlier.share_;
    engine_.start_at(end.sequence + 1, end.last_sample + 1);
    consumed_sample_ = end.last_sample;
    publish_state();
  }

 private:
  void item(const Item& item) noexcept override;
  void decision(const Decision& decision) noexcept override;
  void publish(const Item& item) noexcept;
  void publish_state() noexcept;
  [[nodiscard]] std::uint64_t last_past(const std::atomic<std::uint64_t>& last_dropped,
                                        std::uint64_t consumed) const noexcept;

  StreamEngine engine_;
  std::uint32_t stream_;
  std::uint64_t depth_;
  StreamCounters& counters_;
  const WorkerPorts& ports_;
  const PartnerRoutes& routes_;
  const std::uint64_t& next_item_;
  const std::uint64_t& handled_item_;
  std::vector<Command> first_commands_;
  std::size_t begun_ = 0;              // how many of them were applied
  std::uint64_t consumed_sample_ = 0;  // its sequence; it may have been shed
  RingShare share_;                    // of ports_.out
  Decision placed_;                    // kept here because it is large
};

}  // namespace posed::pipeline
