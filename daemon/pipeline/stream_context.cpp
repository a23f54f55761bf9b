#include "daemon/pipeline/stream_context.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "posed/v1/posed.pb.h"

namespace posed::pipeline {
namespace {

bool is_pose(const Item& item) noexcept {
  return item.kind == Item::Kind::kFrame || item.kind == Item::Kind::kRawFrame;
}

// Events that a device can trigger at any rate must fit into its stream's share of the ring; of the
// others only a few ever come at once.
bool within_share(const Item& item) noexcept {
  return item.kind != Item::Kind::kEvent || item.stream_event.kind == v1::Event::KIND_SHED ||
         item.stream_event.kind == v1::Event::KIND_CLOCK_JUMPED;
}

}  // namespace

std::uint64_t shed_depth(double rate_hz) noexcept {
  return static_cast<std::uint64_t>(std::max(3.0, std::ceil(rate_hz * 0.05)));
}

StreamContext::StreamContext(EngineOptions options, double rate_hz, StreamCounters& counters,
                             std::size_t slots, const WorkerPorts& ports,
                             const PartnerRoutes& routes, const std::uint64_t& next_item,
                             const std::uint64_t& handled_item)
    : engine_(std::move(options)),
      stream_(engine_.stream()),
      depth_(shed_depth(rate_hz)),
      counters_(counters),
      ports_(ports),
      routes_(routes),
      next_item_(next_item),
      handled_item_(handled_item),
      share_(slots, counters.publisher.taken) {
  const NextNumbers next = next_numbers(counters);
  engine_.start_at(next.frame, next.sample);
  consumed_sample_ = next.sample - 1;
}

void StreamContext::frame(const Frame& frame) noexcept {
  const std::uint64_t sequence = frame.header.sequence;
  counters_.pipeline.consumed.store(sequence, std::memory_order_release);
  if (counters_.reader.newest.load(std::memory_order_acquire) >= sequence + depth_) {
    return count(counters_.pipeline.shed);
  }
  engine_.on_frame(frame, *this);
}

void StreamContext::sample(const Sample& sample) noexcept {
  consumed_sample_ = sample.header.sequence;
  const std::uint64_t newest = counters_.reader.newest_sample.load(std::memory_order_acquire);
  if (newest >= sample.header.sequence + depth_) return count(counters_.pipeline.shed);
  engine_.on_sample(sample, *this);
}

// What was decoded last but never came was shed.
void StreamContext::end(const StreamEvent& event) noexcept {
  engine_.close_gaps(event.sequence, event.last_sample, *this);
  engine_.end(event.time_ns, event.leaves, *this);
}

void StreamContext::pass_on(const StreamEvent& event) noexcept {
  Item passed;
  passed.kind = Item::Kind::kEvent;
  passed.stream_event = event;
  item(passed);
}

void StreamContext::handled() noexcept {
  count(counters_.pipeline.taken);
  publish_state();
}

Ack StreamContext::apply(const Command& command) noexcept {
  const Ack ack = engine_.apply(command, *this);
  publish_state();  // before the Ack, because its receiver may ask for the status at once
  return ack;
}

// The last frame (or sample) that is known not to come any more, or that came. Those that the
// reader put into the ring before it dropped one have been taken if the ring is empty.
std::uint64_t StreamContext::last_past(const std::atomic<std::uint64_t>& last_dropped,
                                       std::uint64_t consumed) const noexcept {
  const std::uint64_t dropped = last_dropped.load(std::memory_order_acquire);
  return ports_.in->empty() ? std::max(consumed, dropped) : consumed;
}

// What was skipped is recorded before the tick: after a kill no frame or sample comes that would
// reveal it, and a replay would process it.
void StreamContext::tick(std::int64_t now_ns) noexcept {
  const std::int64_t due_ns = engine_.next_tick_ns();
  if (due_ns == kNoTime_ns || now_ns < due_ns) return;
  const std::uint64_t consumed = counters_.pipeline.consumed.load(std::memory_order_relaxed);
  engine_.close_gaps(last_past(counters_.reader.last_dropped, consumed),
                     last_past(counters_.reader.last_dropped_sample, consumed_sample_), *this);
  if (engine_.tick(now_ns, *this)) publish_state();
}

void StreamContext::flush() noexcept {
  engine_.close_gaps(counters_.reader.frames.load(std::memory_order_acquire),
                     counters_.reader.samples.load(std::memory_order_acquire), *this);
  engine_.flush(*this);
}

// Its partners' stages get each frame, also one for which the publisher has no room.
void StreamContext::item(const Item& item) noexcept {
  publish(item);
  if (ports_.frame_tap != nullptr && item.kind == Item::Kind::kFrame) {
    ports_.frame_tap->frame(item.frame, handled_item_);
  }
  routes_.published(item);
}

void StreamContext::publish(const Item& item) noexcept {
  if ((within_share(item) && !share_.has_room()) || !ports_.out->push(item)) {
    if (ports_.record_sink != nullptr && is_pose(item)) {
      ports_.record_sink->unpublished(item.frame.header.stream);
    }
    return count(counters_.pipeline.dropped);
  }
  share_.add();
  ports_.publisher->notify();
}

void StreamContext::decision(const Decision& decision) noexcept {
  if (ports_.record_sink == nullptr) return;
  placed_ = decision;
  placed_.item = next_item_;
  ports_.record_sink->decision(placed_);
}

void StreamContext::publish_state() noexcept {
  counters_.pipeline.last_out.store(engine_.last_out(), std::memory_order_release);
  counters_.pipeline.state.store(engine_.state(), std::memory_order_relaxed);
  publish_values(engine_, counters_.pipeline);
}

}  // namespace posed::pipeline
