#include "daemon/pipeline/worker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/system/hot_mark.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::pipeline {

namespace {

// Items handled in one turn, so that commands, ticks and the end are served however fast items
// come.
constexpr int kItemsATurn = 256;
// pause before an Ack that did not fit is sent again
constexpr std::int64_t kAcksAgain_ns = 1'000'000;

}  // namespace

std::uint64_t shed_depth(double rate_hz) noexcept {
  return static_cast<std::uint64_t>(std::max(3.0, std::ceil(rate_hz * 0.05)));
}

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

// One stream: its engine, and the place where that engine's output goes.
struct Worker::StreamContext final : EngineOut {
  StreamContext(EngineOptions options, double rate_hz, StreamCounters& stream_counters,
                const WorkerPorts& around, const std::uint64_t& next_item, std::size_t slots)
      : engine(std::move(options)),
        depth(shed_depth(rate_hz)),
        counters(stream_counters),
        ports(around),
        position(next_item),
        share(slots, counters.publisher.taken) {}

  void item(const Item& item) noexcept override {
    outgoing = item;
    if ((within_share(outgoing) && !share.has_room()) || !ports.out->push(outgoing)) {
      if (ports.record_sink != nullptr && is_pose(outgoing))
        ports.record_sink->unpublished(outgoing.frame.header.stream);
      return count(counters.pipeline.dropped);
    }
    share.add();
    ports.publisher->notify();
  }

  void decision(const Decision& decision) noexcept override {
    if (ports.record_sink == nullptr) return;
    placed = decision;
    placed.item = position;
    ports.record_sink->decision(placed);
  }

  // Nothing more comes from the reader: what was decoded last but never came was shed.
  void close_gaps() noexcept {
    engine.close_gaps(counters.reader.frames.load(std::memory_order_acquire),
                      counters.reader.samples.load(std::memory_order_acquire), *this);
  }

  // Newest data wins: a frame that has `depth` or more newer frames waiting behind it is skipped.
  // The engine detects the gap at the next frame.
  void frame(const Frame& frame) noexcept {
    const std::uint64_t sequence = frame.header.sequence;
    counters.pipeline.consumed.store(sequence, std::memory_order_release);
    if (counters.reader.newest.load(std::memory_order_acquire) >= sequence + depth) {
      return count(counters.pipeline.shed);
    }
    engine.on_frame(frame, *this);
  }

  // The same for samples.
  void sample(const Sample& sample) noexcept {
    const std::uint64_t newest = counters.reader.newest_sample.load(std::memory_order_acquire);
    if (newest >= sample.header.sequence + depth) return count(counters.pipeline.shed);
    engine.on_sample(sample, *this);
  }

  // Call after an item of the stream has been handled.
  void taken() noexcept {
    count(counters.pipeline.taken);
    publish_state();
  }

  void publish_state() noexcept {
    counters.pipeline.state.store(engine.state(), std::memory_order_relaxed);
    publish_parameters(engine, counters.pipeline);
  }

  StreamEngine engine;
  std::uint64_t depth;
  StreamCounters& counters;
  const WorkerPorts& ports;
  const std::uint64_t& position;
  RingShare share;  // of ports.out
  Item outgoing;    // kept here because it is large
  Decision placed;  // the same
};

Result<std::unique_ptr<Worker>> Worker::open(const WorkerPorts& ports) {
  auto poller = system::Poller::open();
  if (!poller) return std::unexpected(poller.error());
  if (auto added = (*poller)->add(*ports.wake); !added) return std::unexpected(added.error());
  return std::unique_ptr<Worker>(new Worker(ports, std::move(*poller)));
}

Worker::Worker(const WorkerPorts& ports, std::unique_ptr<system::Poller> poller)
    : ports_(ports), poller_(std::move(poller)) {}

Worker::~Worker() = default;

void Worker::add(EngineOptions options, double rate_hz, StreamCounters& counters,
                 std::size_t slots) {
  contexts_.push_back(std::make_unique<StreamContext>(std::move(options), rate_hz, counters, ports_,
                                                      position_, slots));
}

const StreamEngine& Worker::engine(std::uint32_t stream) const { return contexts_[stream]->engine; }

std::int64_t Worker::turn(std::int64_t now_ns) noexcept {
  send_acks();
  apply_commands();
  take_items(kItemsATurn);
  tick(now_ns);
  return next_due_ns(now_ns);
}

std::int64_t Worker::next_due_ns(std::int64_t now_ns) const noexcept {
  if (!ports_.in->empty()) return now_ns;
  std::int64_t due_ns = unsent_count_ > 0 ? now_ns + kAcksAgain_ns : system::kForever_ns;
  for (const auto& context : contexts_) {
    const std::int64_t tick_ns = context->engine.next_tick_ns();
    if (tick_ns != kNoTime_ns) due_ns = std::min(due_ns, tick_ns);
  }
  return due_ns;
}

void Worker::finish() noexcept {
  send_acks();
  apply_commands();
  while (!ports_.in->empty()) take_items(kItemsATurn);
  for (const auto& context : contexts_) {
    context->close_gaps();
    context->engine.flush(*context);
  }
}

void Worker::run() noexcept {
  const system::HotSection hot;
  while (!stop_.load(std::memory_order_acquire)) {
    const std::int64_t due_ns = turn(ports_.clock());
    ports_.wake->going_to_sleep();
    if (idle()) static_cast<void>(poller_->wait(system::time_left_ns(due_ns, ports_.clock)));
    ports_.wake->awake();
  }
  finish();
}

void Worker::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  ports_.wake->notify();
}

bool Worker::idle() const noexcept {
  return ports_.in->empty() && ports_.commands->empty() && !stop_.load(std::memory_order_acquire);
}

void Worker::apply_commands() noexcept {
  const auto apply = [this](const Command& command) noexcept {
    StreamContext& context = *contexts_[command.stream];
    const Ack ack = context.engine.apply(command, context);
    context.publish_state();  // before the Ack, because its receiver may ask for the status at once
    acknowledge(ack);
  };
  while (ports_.commands->consume(apply)) {
  }
}

void Worker::take_items(int most) noexcept {
  const auto take_one = [this](const Item& item) noexcept { take(item); };
  for (int i = 0; i < most && ports_.in->consume(take_one); ++i) {
  }
}

// No Ack is ever lost: control counts the commands for which it has not received an Ack, and sends
// at most kMaxUnderWay of them. So unsent_ has space for each.
void Worker::acknowledge(const Ack& ack) noexcept {
  if (ack.ticket == 0) return;  // no Ack is expected
  send_acks();
  if (unsent_count_ > 0 || !ports_.acks->push(ack)) {
    unsent_[unsent_count_++] = ack;
  } else if (ports_.control != nullptr) {
    ports_.control->notify();
  }
}

// Sends them in the order in which the commands took effect.
void Worker::send_acks() noexcept {
  std::size_t sent = 0;
  while (sent < unsent_count_ && ports_.acks->push(unsent_[sent])) ++sent;
  if (sent == 0) return;
  std::copy(unsent_.begin() + static_cast<std::ptrdiff_t>(sent),
            unsent_.begin() + static_cast<std::ptrdiff_t>(unsent_count_), unsent_.begin());
  unsent_count_ -= sent;
  if (ports_.control != nullptr) ports_.control->notify();
}

void Worker::take(const Item& item) noexcept {
  position_ = item.number;
  switch (item.kind) {
    case Item::Kind::kFrame:
    case Item::Kind::kRawFrame: {
      StreamContext& context = *contexts_[item.frame.header.stream];
      context.frame(item.frame);
      context.taken();
      break;
    }
    case Item::Kind::kSample: {
      StreamContext& context = *contexts_[item.sample.header.stream];
      context.sample(item.sample);
      context.taken();
      break;
    }
    case Item::Kind::kEvent: {
      StreamContext& context = *contexts_[item.stream_event.stream];
      if (item.stream_event.kind == v1::Event::KIND_ENDED) {
        context.close_gaps();
        context.engine.end(item.stream_event.time_ns, context);
      } else {
        pass_on(item.stream_event, context);
      }
      context.taken();
      break;
    }
  }
  position_ = item.number + 1;
}

// Passes on an event of the reader. It comes from the same ring as the frames, so it keeps its
// place between them.
void Worker::pass_on(const StreamEvent& event, StreamContext& context) noexcept {
  acknowledge({.ticket = event.ticket, .stream = event.stream, .sequence = event.sequence + 1});
  Item item;
  item.kind = Item::Kind::kEvent;
  item.stream_event = event;
  context.item(item);
}

void Worker::tick(std::int64_t now_ns) noexcept {
  for (const auto& context : contexts_) {
    if (context->engine.tick(now_ns, *context)) context->publish_state();
  }
}

}  // namespace posed::pipeline
