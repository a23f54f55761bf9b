#include "daemon/pipeline/stream_engine.hpp"

#include "posed/v1/posed.pb.h"

namespace posed::pipeline {
namespace {

constexpr std::int64_t kHeldEvery_ns = kNanosPerSecond;

}  // namespace

StreamEngine::StreamEngine(const EngineOptions& options) noexcept
    : options_(options), model_(options.model) {
  if (options.style) style_.emplace(options.model, *options.style);
}

float StreamEngine::alpha() const noexcept { return style_ ? style_->alpha() : 0.0F; }

void StreamEngine::on_frame(const Frame& frame, EngineOut& out) noexcept {
  const Header& header = frame.header;
  const std::uint64_t expected = last_sequence_ + 1;
  if (header.sequence > expected) {
    const std::uint64_t missing = header.sequence - expected;
    out.decision({.kind = Decision::Kind::kShed,
                  .stream = options_.stream,
                  .sequence = expected,
                  .count = missing});
    notice(v1::Event::KIND_SHED, header.arrival_ns, expected, static_cast<double>(missing), out);
  }
  last_sequence_ = header.sequence;
  heard(header.arrival_ns, out);
  if (options_.publish_raw) {
    pose_.kind = Item::Kind::kRawFrame;
    pose_.frame = frame;
    out.item(pose_);
  }
  out_ = &out;
  if (style_) {
    style_->step(&frame, header.arrival_ns, *this);
  } else {
    this->frame(frame);
  }
}

void StreamEngine::frame(const Frame& frame) noexcept {
  pose_.kind = Item::Kind::kFrame;
  pose_.frame = frame;
  has_pose_ = true;
  out_->item(pose_);
}

void StreamEngine::on_sample(const Sample& sample, EngineOut& out) noexcept {
  heard(sample.header.arrival_ns, out);
  other_.kind = Item::Kind::kSample;
  other_.sample = sample;
  out.item(other_);
}

// Something came: a silent stream has recovered.
void StreamEngine::heard(std::int64_t arrival_ns, EngineOut& out) noexcept {
  last_arrival_ns_ = arrival_ns;
  const StreamState before = state_;
  state_ = StreamState::kLive;
  if (before == StreamState::kWaiting) {
    notice(v1::Event::KIND_STARTED, arrival_ns, last_sequence_, 0.0, out);
  } else if (before == StreamState::kStale) {
    notice(v1::Event::KIND_RECOVERED, arrival_ns, last_sequence_, 0.0, out);
  }
}

std::int64_t StreamEngine::next_tick_ns() const noexcept {
  if (state_ == StreamState::kLive) return last_arrival_ns_ + options_.stale_after_ns;
  if (state_ == StreamState::kStale) return next_held_ns_;
  return kNoTime_ns;
}

bool StreamEngine::tick(std::int64_t now_ns, EngineOut& out) noexcept {
  const std::int64_t due_ns = next_tick_ns();
  if (due_ns == kNoTime_ns || now_ns < due_ns) return false;
  tick_now(now_ns, out);
  return true;
}

void StreamEngine::tick_now(std::int64_t now_ns, EngineOut& out) noexcept {
  out.decision({.kind = Decision::Kind::kTick,
                .stream = options_.stream,
                .sequence = last_sequence_ + 1,
                .now_ns = now_ns});
  if (state_ == StreamState::kLive) {
    state_ = StreamState::kStale;
    notice(v1::Event::KIND_STALE, now_ns, last_sequence_, seconds(now_ns - last_arrival_ns_), out);
  }
  next_held_ns_ = now_ns + kHeldEvery_ns;
  if (has_pose_) {
    pose_.kind = Item::Kind::kFrame;
    pose_.frame.quality = Quality::kStale;
    out.item(pose_);
  }
}

Ack StreamEngine::apply(const Command& command, EngineOut& out) noexcept {
  Ack ack{.ticket = command.ticket, .stream = options_.stream, .sequence = last_sequence_ + 1};
  Decision decision{.stream = options_.stream, .sequence = ack.sequence};
  if (command.kind == Command::Kind::kAlpha) {
    decision.kind = Decision::Kind::kAlpha;
    decision.alpha = command.alpha;
    if (style_) style_->set_alpha(command.alpha);
  } else {
    decision.kind = Decision::Kind::kModel;
    decision.model_hash = command.model_hash;
    ack.retired = style_ ? style_->set_model(command.model) : command.model;
    if (style_) model_ = command.model;
  }
  out.decision(decision);
  notice(v1::Event::KIND_CONTROL, last_arrival_ns_, ack.sequence, command.alpha, out);
  return ack;
}

void StreamEngine::end(std::int64_t now_ns, EngineOut& out) noexcept {
  state_ = StreamState::kEnded;
  notice(v1::Event::KIND_ENDED, now_ns, last_sequence_, 0.0, out);
}

void StreamEngine::notice(std::uint8_t event, std::int64_t time_ns, std::uint64_t sequence,
                          double value, EngineOut& out) noexcept {
  other_.kind = Item::Kind::kNotice;
  other_.notice = {options_.stream, event, time_ns, sequence, value};
  out.item(other_);
}

}  // namespace posed::pipeline
