#include "daemon/pipeline/stream_engine.hpp"

#include <algorithm>

#include "posed/v1/posed.pb.h"

namespace posed::pipeline {
namespace {

constexpr std::int64_t kHeldEvery_ns = kNanosPerSecond;
// Silence after which frames that wait in the generate stage go out: none that is only late.
constexpr std::int64_t kSilence_ns = 100'000'000;
constexpr std::int64_t kSilentFrames = 4;

void add_labels(const gesture::GestureModel& model, const gesture::PlayOrder& order,
                ShortText& text) noexcept {
  for (const std::uint16_t label : order.labels()) {
    if (label >= model.labels.size() || text.cut()) return;
    if (!text.text().empty()) text.add(" ");
    text.add(model.labels[label].name);
  }
}

}  // namespace

StreamEngine::StreamEngine(const EngineOptions& options) noexcept
    : options_(options), model_(options.model) {
  if (options.style) style_.emplace(options.model, *options.style);
  if (options.constrain) constrain_.emplace(options.skeleton);
  if (!options.generate) return;
  const double rate_hz = generate::stream_rate_hz(options.rate_hz);
  period_ns_ = nanoseconds(1.0 / rate_hz);
  generate_.emplace(options.skeleton, *options.generate, rate_hz, options.gesture);
}

float StreamEngine::alpha() const noexcept { return style_ ? style_->alpha() : 0.0F; }

float StreamEngine::alpha_target() const noexcept { return style_ ? style_->alpha_target() : 0.0F; }

void StreamEngine::on_frame(const Frame& frame, EngineOut& out) noexcept {
  const Header& header = frame.header;
  shed_until(header.sequence, header.arrival_ns, out);
  last_sequence_ = header.sequence;
  heard(header.arrival_ns, out);
  if (options_.publish_raw) {
    pose_.kind = Item::Kind::kRawFrame;
    pose_.frame = frame;
    out.item(pose_);
  }
  out_ = &out;
  if (style_) {
    style_->step(&frame, header.arrival_ns, styled_);
  } else {
    generate(frame);
  }
  tell_played(header.arrival_ns, out);
}

// The frames before this one that have not come never will.
void StreamEngine::shed_until(std::uint64_t sequence, std::int64_t time_ns,
                              EngineOut& out) noexcept {
  const std::uint64_t expected = last_sequence_ + 1;
  if (sequence <= expected) return;
  const std::uint64_t missing = sequence - expected;
  out.decision({.kind = Decision::Kind::kShed,
                .stream = options_.stream,
                .sequence = expected,
                .count = missing});
  event(v1::Event::KIND_SHED, time_ns, expected, static_cast<double>(missing), out);
  last_sequence_ = sequence - 1;
}

void StreamEngine::shed_samples_until(std::uint64_t sequence, EngineOut& out) noexcept {
  const std::uint64_t expected = last_sample_ + 1;
  if (sequence <= expected) return;
  out.decision({.kind = Decision::Kind::kShedSamples,
                .stream = options_.stream,
                .sequence = expected,
                .count = sequence - expected});
  last_sample_ = sequence - 1;
}

void StreamEngine::close_gaps(std::uint64_t last_frame, std::uint64_t last_sample,
                              EngineOut& out) noexcept {
  shed_until(last_frame + 1, last_arrival_ns_, out);
  shed_samples_until(last_sample + 1, out);
}

void StreamEngine::generate(const Frame& frame) noexcept {
  if (generate_) {
    generate_->step(&frame, frame.header.arrival_ns, *this);
  } else {
    this->frame(frame);
  }
}

void StreamEngine::frame(const Frame& frame) noexcept {
  pose_.kind = Item::Kind::kFrame;
  pose_.frame = frame;
  if (constrain_) {
    constrain_->step(pose_.frame,
                     generate_ ? generate_->variance_rad2() : std::span<const double>());
  }
  has_pose_ = true;
  last_out_ = frame.header.sequence;
  out_->item(pose_);
}

void StreamEngine::on_sample(const Sample& sample, EngineOut& out) noexcept {
  shed_samples_until(sample.header.sequence, out);
  last_sample_ = sample.header.sequence;
  heard(sample.header.arrival_ns, out);
  other_.kind = Item::Kind::kSample;
  other_.sample = sample;
  out.item(other_);
}

// Something came: a silent stream has recovered.
void StreamEngine::heard(std::int64_t arrival_ns, EngineOut& out) noexcept {
  last_arrival_ns_ = arrival_ns;
  last_generate_ns_ = kNoTime_ns;
  const StreamState before = state_;
  state_ = StreamState::kLive;
  if (before == StreamState::kWaiting) {
    event(v1::Event::KIND_STARTED, arrival_ns, last_sequence_, 0.0, out);
  } else if (before == StreamState::kStale) {
    event(v1::Event::KIND_RECOVERED, arrival_ns, last_sequence_, 0.0, out);
  }
}

std::int64_t StreamEngine::stale_due_ns() const noexcept {
  if (state_ == StreamState::kLive) return last_arrival_ns_ + options_.stale_after_ns;
  if (state_ == StreamState::kStale) return next_held_ns_;
  return kNoTime_ns;
}

std::int64_t StreamEngine::generate_due_ns() const noexcept {
  const bool runs = state_ == StreamState::kLive || state_ == StreamState::kStale;
  if (!runs || !generate_ || !generate_->waiting()) return kNoTime_ns;
  if (last_generate_ns_ != kNoTime_ns) return last_generate_ns_ + period_ns_;
  return last_arrival_ns_ + std::max(kSilence_ns, kSilentFrames * period_ns_);
}

std::int64_t StreamEngine::next_tick_ns() const noexcept {
  const std::int64_t generate_ns = generate_due_ns();
  const std::int64_t stale_ns = stale_due_ns();
  return generate_ns == kNoTime_ns ? stale_ns : std::min(generate_ns, stale_ns);
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
  const bool generates = generate_due_ns() != kNoTime_ns && now_ns >= generate_due_ns();
  const bool stale = !generates || now_ns >= stale_due_ns();
  if (generates) {
    out_ = &out;
    last_generate_ns_ = now_ns;
    generate_->step(nullptr, now_ns, *this);
    tell_played(now_ns, out);
  }
  if (!stale) return;
  if (state_ == StreamState::kLive) {
    state_ = StreamState::kStale;
    event(v1::Event::KIND_STALE, now_ns, last_sequence_, seconds(now_ns - last_arrival_ns_), out);
  }
  next_held_ns_ = now_ns + kHeldEvery_ns;
  if (has_pose_ && !(generate_ && generate_->performs())) {
    pose_.kind = Item::Kind::kFrame;
    pose_.frame.quality = Quality::kStale;
    out.item(pose_);
  }
}

Ack StreamEngine::apply(const Command& command, EngineOut& out) noexcept {
  Ack ack{.ticket = command.ticket, .stream = options_.stream, .sequence = last_sequence_ + 1};
  Decision decision{.stream = options_.stream, .sequence = ack.sequence};
  StreamEvent told{options_.stream, v1::Event::KIND_CONTROL, last_arrival_ns_, 0, 0.0};
  describe(command, told);
  switch (command.kind) {
    case Command::Kind::kAlpha:
      decision.kind = Decision::Kind::kAlpha;
      decision.alpha = command.alpha;
      if (style_) style_->set_alpha(command.alpha);
      break;
    case Command::Kind::kModel:
      decision.kind = Decision::Kind::kModel;
      decision.model_hash = command.model_hash;
      if (style_) static_cast<void>(style_->set_model(command.model));
      if (style_) model_ = command.model;
      break;
    case Command::Kind::kGesture:
      decision.kind = Decision::Kind::kGesture;
      decision.model_hash = command.model_hash;
      if (generate_) generate_->set_model(command.gesture);
      break;
    case Command::Kind::kPlay:
      decision.kind = Decision::Kind::kPlay;
      decision.play = command.play;
      ack.refused = !generate_ || !generate_->play(command.play);
      performs_ = performs_ || !ack.refused;
      ack.sequence = last_out_ + 1;
      break;
    case Command::Kind::kStopPlaying:
      decision.kind = Decision::Kind::kStopPlaying;
      if (generate_) generate_->stop_playing();
      ack.sequence = last_out_ + 1;
      break;
  }
  out.decision(decision);
  if (ack.refused) return ack;
  told.sequence = ack.sequence;
  other_.kind = Item::Kind::kEvent;
  other_.stream_event = told;
  out.item(other_);
  return ack;
}

// What the command is about to change, for people.
void StreamEngine::describe(const Command& command, StreamEvent& event) const noexcept {
  switch (command.kind) {
    case Command::Kind::kAlpha:
      event.alpha_before = alpha_target();
      event.value = command.alpha;
      break;
    case Command::Kind::kModel:
      event.change = Change::kStyleModel;
      if (model_ != nullptr) event.before = ShortText(model_->name);
      if (command.model != nullptr) event.after = ShortText(command.model->name);
      break;
    case Command::Kind::kGesture:
      event.change = Change::kGestureModel;
      if (gesture() != nullptr) event.before = ShortText(gesture()->name);
      if (command.gesture != nullptr) event.after = ShortText(command.gesture->name);
      break;
    case Command::Kind::kPlay:
      event.kind = v1::Event::KIND_PLAYING;
      event.value = command.play.size;
      if (gesture() != nullptr) add_labels(gesture()->gesture(), command.play, event.after);
      break;
    case Command::Kind::kStopPlaying:
      event.change = Change::kStopPlaying;
      break;
  }
}

void StreamEngine::flush(EngineOut& out) noexcept {
  out_ = &out;
  if (generate_) generate_->flush(*this);
}

void StreamEngine::tell_played(std::int64_t time_ns, EngineOut& out) noexcept {
  const bool performed = performs_;
  performs_ = generate_ && generate_->performs();
  if (performed && !performs_) event(v1::Event::KIND_PLAYED, time_ns, last_out_, 0.0, out);
}

void StreamEngine::end(std::int64_t now_ns, EngineOut& out) noexcept {
  out.decision({.kind = Decision::Kind::kEnd,
                .stream = options_.stream,
                .sequence = last_sequence_ + 1,
                .now_ns = now_ns});
  flush(out);
  state_ = StreamState::kEnded;
  event(v1::Event::KIND_ENDED, now_ns, last_sequence_, 0.0, out);
}

void StreamEngine::event(std::uint8_t event, std::int64_t time_ns, std::uint64_t sequence,
                         double value, EngineOut& out) noexcept {
  other_.kind = Item::Kind::kEvent;
  other_.stream_event = {options_.stream, event, time_ns, sequence, value};
  out.item(other_);
}

}  // namespace posed::pipeline
