#include "daemon/pipeline/worker.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "daemon/pipeline/stream_context.hpp"
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

Result<std::unique_ptr<Worker>> Worker::open(const WorkerPorts& ports) {
  auto poller = TRY(system::Poller::open());
  TRY(poller->add(*ports.wake));
  return std::unique_ptr<Worker>(new Worker(ports, std::move(poller)));
}

Worker::Worker(const WorkerPorts& ports, std::unique_ptr<system::Poller> poller)
    : ports_(ports),
      poller_(std::move(poller)),
      contexts_(ports.streams->slots),
      coming_(ports.streams->slots) {
  routes_.reserve(contexts_.size());
}

Worker::~Worker() = default;

std::unique_ptr<StreamContext> Worker::make_context(EngineOptions options, double rate_hz,
                                                    StreamCounters& counters,
                                                    std::size_t slots) const {
  return std::make_unique<StreamContext>(std::move(options), rate_hz, counters, slots, ports_,
                                         routes_, position_, handled_);
}

void Worker::put(std::uint32_t slot, StreamContext& context) noexcept {
  assert(contexts_[slot] == nullptr);  // a slot has one stream at a time
  contexts_[slot] = &context;
  context.join(routes_);
}

std::int64_t Worker::turn(std::int64_t now_ns) noexcept {
  send_acks();
  accept_streams();
  apply_commands();
  handle_items(kItemsATurn);
  tick(now_ns);
  return next_due_ns(now_ns);
}

std::int64_t Worker::next_due_ns(std::int64_t now_ns) const noexcept {
  if (!ports_.in->empty()) return now_ns;
  std::int64_t due_ns = unsent_count_ > 0 ? now_ns + kAcksAgain_ns : system::kForever_ns;
  for (const StreamContext* context : contexts_) {
    if (context == nullptr) continue;
    const std::int64_t tick_ns = context->engine().next_tick_ns();
    if (tick_ns != kNoTime_ns) due_ns = std::min(due_ns, tick_ns);
  }
  return due_ns;
}

void Worker::finish() noexcept {
  send_acks();
  apply_commands();
  while (!ports_.in->empty()) handle_items(kItemsATurn);
  for (StreamContext* context : contexts_) {
    if (context != nullptr) context->flush();
  }
}

void Worker::run() noexcept {
  const system::HotSection hot;
  while (!stop_.load(std::memory_order_acquire)) {
    pulse_.beat();
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

// A stream that gets the slot of another waits until that one has left.
void Worker::accept_streams() noexcept {
  const auto accept = [this](StreamContext* context) noexcept {
    const std::uint32_t slot = slot_of(context->stream());
    assert(slot < contexts_.size());
    if (contexts_[slot] == nullptr) return put(slot, *context);
    assert(coming_[slot] == nullptr);  // the builder waits until its last one has the slot
    coming_[slot] = context;
  };
  while (ports_.streams->coming.consume(accept)) {
  }
}

// Null if there is no such stream any more. A stream is handed over before its first item and its
// first command can come.
StreamContext* Worker::find(std::uint32_t stream) noexcept {
  const std::uint32_t slot = slot_of(stream);
  if (slot >= contexts_.size()) return nullptr;
  if (contexts_[slot] == nullptr) accept_streams();
  StreamContext* const context = contexts_[slot];
  return context != nullptr && context->stream() == stream ? context : nullptr;
}

// The stream has left: its owner gets it back, and the slot goes to the stream that waits for it.
void Worker::give_back(StreamContext& context, const StreamEvent& end) noexcept {
  const std::uint32_t slot = slot_of(context.stream());
  accept_streams();
  context.leave(routes_);
  contexts_[slot] = nullptr;
  if (StreamContext* const next = std::exchange(coming_[slot], nullptr)) {
    put(slot, *next);
    next->follow(context, end);
  }
  const bool returned = ports_.streams->gone.push(&context);
  assert(returned);  // it has room for all streams that are there and that wait
  ports_.streams->builder.notify();
}

void Worker::apply_commands() noexcept {
  const auto apply = [this](const Command& command) noexcept {
    StreamContext* const context = find(command.stream);
    if (context == nullptr) {
      return acknowledge({.ticket = command.ticket,
                          .stream = command.stream,
                          .sequence = 0,
                          .refused = true,
                          .gone = true});
    }
    context->begin();  // what the config says comes before what control says
    acknowledge(context->apply(command));
  };
  while (ports_.commands->consume(apply)) {
  }
}

void Worker::handle_items(int most) noexcept {
  const auto handle_one = [this](const Item& item) noexcept { handle(item); };
  for (int i = 0; i < most && ports_.in->consume(handle_one); ++i) {
  }
}

// No Ack is ever lost: control counts the commands for which it has not received an Ack, and sends
// at most kMaxUnderWay of them. So unsent_ has space for each.
void Worker::acknowledge(const Ack& ack) noexcept {
  if (ack.ticket == 0) return;  // no Ack is expected
  send_acks();
  if (unsent_count_ > 0 || !ports_.acks->push(ack)) {
    assert(unsent_count_ < unsent_.size());
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

void Worker::handle(const Item& item) noexcept {
  assert(item.number >= position_);  // the reader counts upwards
  position_ = handled_ = item.number;
  StreamContext* const context = find(stream_of(item));
  if (context != nullptr) handle(item, *context);
  position_ = item.number + 1;
}

void Worker::handle(const Item& item, StreamContext& context) noexcept {
  context.begin();
  switch (item.kind) {
    case Item::Kind::kFrame:
    case Item::Kind::kRawFrame:
      context.frame(item.frame);
      return context.handled();
    case Item::Kind::kSample:
      context.sample(item.sample);
      return context.handled();
    case Item::Kind::kEvent:
      break;
  }
  const StreamEvent& event = item.stream_event;
  if (event.kind != v1::Event::KIND_ENDED) {
    acknowledge({.ticket = event.ticket, .stream = event.stream, .sequence = event.sequence + 1});
    context.pass_on(event);
    return context.handled();
  }
  if (context.engine().state() != StreamState::kEnded) context.end(event);
  context.handled();
  if (event.leaves) give_back(context, event);
}

void Worker::tick(std::int64_t now_ns) noexcept {
  for (StreamContext* context : contexts_) {
    if (context != nullptr) context->tick(now_ns);
  }
}

}  // namespace posed::pipeline
