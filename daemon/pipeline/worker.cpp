#include "daemon/pipeline/worker.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/pipeline/hot_mark.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::pipeline {

std::uint64_t shed_depth(double rate_hz) noexcept {
  return static_cast<std::uint64_t>(std::max(3.0, std::ceil(rate_hz * 0.05)));
}

namespace {

bool is_pose(const Item& item) noexcept {
  return item.kind == Item::Kind::kFrame || item.kind == Item::Kind::kRawFrame;
}

}  // namespace

// One stream: its engine, and where that engine's output goes.
struct Worker::Lane final : EngineOut {
  Lane(const EngineOptions& options, double rate_hz, StreamCounters& stream_counters,
       const WorkerPorts& around, const std::uint64_t& next_item)
      : engine(options),
        depth(shed_depth(rate_hz)),
        counters(stream_counters),
        ports(around),
        place(next_item) {}

  void item(const Item& item) noexcept override {
    outgoing = item;
    if (outgoing.kind == Item::Kind::kFrame) outgoing.frame.stamps.styled_ns = ports.clock();
    if (!ports.out->push(outgoing)) {
      if (ports.tape != nullptr && is_pose(outgoing))
        ports.tape->unpublished(outgoing.frame.header.stream);
      return count(counters.pipeline.dropped);
    }
    ports.publisher->ring();
  }

  void decision(const Decision& decision) noexcept override {
    if (ports.tape == nullptr) return;
    placed = decision;
    placed.item = place;
    ports.tape->decision(placed);
  }

  // Nothing more comes from the reader: what of the last it decoded is missing was shed.
  void close_gaps() noexcept {
    engine.close_gaps(counters.reader.frames.load(std::memory_order_acquire),
                      counters.reader.samples.load(std::memory_order_acquire), *this);
  }

  // Newest data wins: a frame with `depth` or more newer ones behind it is skipped. The engine
  // sees the gap at the next frame.
  void frame(const Frame& frame) noexcept {
    const std::uint64_t sequence = frame.header.sequence;
    counters.pipeline.consumed.store(sequence, std::memory_order_release);
    if (counters.reader.newest.load(std::memory_order_acquire) >= sequence + depth) {
      return count(counters.pipeline.shed);
    }
    engine.on_frame(frame, *this);
  }

  void tell() noexcept {
    counters.pipeline.state.store(engine.state(), std::memory_order_relaxed);
    counters.pipeline.alpha.store(engine.alpha(), std::memory_order_relaxed);
  }

  StreamEngine engine;
  std::uint64_t depth;
  StreamCounters& counters;
  const WorkerPorts& ports;
  const std::uint64_t& place;
  Item outgoing;    // kept here because it is large
  Decision placed;  // the same
};

Result<std::unique_ptr<Worker>> Worker::open(const WorkerPorts& ports) {
  auto poller = Poller::open();
  if (!poller) return std::unexpected(poller.error());
  if (auto added = (*poller)->add(*ports.wake); !added) return std::unexpected(added.error());
  return std::unique_ptr<Worker>(new Worker(ports, std::move(*poller)));
}

Worker::Worker(const WorkerPorts& ports, std::unique_ptr<Poller> poller)
    : ports_(ports), poller_(std::move(poller)) {}

Worker::~Worker() = default;

void Worker::add(const EngineOptions& options, double rate_hz, StreamCounters& counters) {
  lanes_.push_back(std::make_unique<Lane>(options, rate_hz, counters, ports_, place_));
}

const StreamEngine& Worker::engine(std::uint32_t stream) const { return lanes_[stream]->engine; }

void Worker::run() noexcept {
  const HotSection hot;
  while (!stop_.load(std::memory_order_acquire)) {
    drain();
    tick(ports_.clock());
    ports_.wake->going_to_sleep();
    if (idle()) {
      std::int64_t due_ns = kForever_ns;
      for (const auto& lane : lanes_) {
        const std::int64_t lane_due_ns = lane->engine.next_tick_ns();
        if (lane_due_ns != kNoTime_ns) due_ns = std::min(due_ns, lane_due_ns);
      }
      if (due_ns != kForever_ns) due_ns = std::max<std::int64_t>(due_ns - ports_.clock(), 0);
      static_cast<void>(poller_->wait(due_ns));
    }
    ports_.wake->awake();
  }
  drain();
  for (const auto& lane : lanes_) {
    lane->close_gaps();
    lane->engine.flush(*lane);
  }
}

void Worker::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  ports_.wake->ring();
}

bool Worker::idle() const noexcept {
  return ports_.in->empty() && ports_.commands->empty() && !stop_.load(std::memory_order_acquire);
}

void Worker::drain() noexcept {
  const auto apply = [this](const Command& command) noexcept {
    Lane& lane = *lanes_[command.stream];
    const Ack ack = lane.engine.apply(command, lane);
    // There is room: control waits for the Ack before it sends more than the ring holds.
    static_cast<void>(ports_.acks->push(ack));
    if (ports_.control != nullptr) ports_.control->ring();
    lane.tell();
  };
  while (ports_.acks->has_room() && ports_.commands->consume(apply)) {
  }
  while (ports_.in->consume([this](const Item& item) noexcept { take(item); })) {
  }
}

void Worker::take(const Item& item) noexcept {
  place_ = item.number;
  switch (item.kind) {
    case Item::Kind::kFrame:
    case Item::Kind::kRawFrame: {
      Lane& lane = *lanes_[item.frame.header.stream];
      lane.frame(item.frame);
      lane.tell();
      break;
    }
    case Item::Kind::kSample: {
      Lane& lane = *lanes_[item.sample.header.stream];
      lane.engine.on_sample(item.sample, lane);
      lane.tell();
      break;
    }
    case Item::Kind::kNotice: {
      Lane& lane = *lanes_[item.notice.stream];
      if (item.notice.event == v1::Event::KIND_ENDED) {
        lane.close_gaps();
        lane.engine.end(item.notice.time_ns, lane);
      } else {
        pass_on(item.notice, lane);
      }
      lane.tell();
      break;
    }
  }
  place_ = item.number + 1;
}

// What the reader did between two frames: their order is right here.
void Worker::pass_on(const Notice& notice, Lane& lane) noexcept {
  if (notice.ticket != 0) {
    const Ack ack{
        .ticket = notice.ticket, .stream = notice.stream, .sequence = notice.sequence + 1};
    static_cast<void>(ports_.acks->push(ack));  // there is room, as for every command
    if (ports_.control != nullptr) ports_.control->ring();
  }
  Item item;
  item.kind = Item::Kind::kNotice;
  item.notice = notice;
  lane.item(item);
}

void Worker::tick(std::int64_t now_ns) noexcept {
  for (const auto& lane : lanes_) {
    if (lane->engine.tick(now_ns, *lane)) lane->tell();
  }
}

}  // namespace posed::pipeline
