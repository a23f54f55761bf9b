#include "daemon/pipeline/stream_engine.hpp"

#include <algorithm>
#include <utility>

#include "models/hand/constrain_stage.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::pipeline {
namespace {

constexpr std::int64_t kHeldEvery_ns = kNanosPerSecond;

void add_labels(const gesture::GestureModel& model, const gesture::PlayOrder& order,
                ShortText& text) noexcept {
  for (const std::uint16_t label : order.labels()) {
    if (label >= model.labels.size() || text.cut()) return;
    if (!text.text().empty()) text.add(" ");
    text.add(model.labels[label].name);
  }
}

}  // namespace

std::vector<std::string> stage_names(const EngineOptions& options) {
  std::vector<std::string> names;
  if (options.style) names.push_back("style");
  if (options.generate) names.push_back("generate");
  if (options.constrain) names.push_back("constrain");
  return names;
}

StreamEngine::StreamEngine(const EngineOptions& options)
    : options_(options), model_(options.model) {
  if (options.style) {
    auto stage = std::make_unique<style::StyleFilter>(options.model, *options.style);
    style_ = stage.get();
    stages_.push_back(std::move(stage));
  }
  if (options.generate) {
    auto stage = std::make_unique<generate::GenerateStage>(
        options.skeleton, *options.generate, generate::stream_rate_hz(options.rate_hz),
        options.gesture);
    generate_ = stage.get();
    stages_.push_back(std::move(stage));
  }
  if (options.constrain) {
    stages_.push_back(std::make_unique<hand::ConstrainStage>(options.skeleton));
  }
}

class StreamEngine::Chain final : public StageOut {
 public:
  Chain(StreamEngine& engine, std::size_t next, EngineOut& out) noexcept
      : engine_(engine), next_(next), out_(out) {}
  void frame(const StageFrame& frame) noexcept override { engine_.run(next_, frame, out_); }

 private:
  StreamEngine& engine_;
  std::size_t next_;
  EngineOut& out_;
};

// Runs the frame through the stages from `next` on, then emits it.
void StreamEngine::run(std::size_t next, const StageFrame& frame, EngineOut& out) noexcept {
  if (next == stages_.size()) return emit(frame.frame, out);
  Chain rest(*this, next + 1, out);
  const std::size_t before = time_stage(next);
  stages_[next]->process(frame, rest);
  time_stage(before);
}

// From now on, time is charged to this stage; kMaxStages: to none. Returns the stage that was
// charged before.
std::size_t StreamEngine::time_stage(std::size_t stage) noexcept {
  if (options_.clock == nullptr) return stage;
  const std::int64_t now_ns = options_.clock();
  if (timed_stage_ < kMaxStages) {
    stage_us_[timed_stage_] += static_cast<float>(now_ns - timed_since_ns_) * 1e-3F;
  }
  timed_since_ns_ = now_ns;
  return std::exchange(timed_stage_, stage);
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
  stage_us_.fill(0.0F);
  run(0, {.frame = frame, .input = &frame}, out);
  report_played(header.arrival_ns, out);
}

// Frames before this sequence that have not come by now are counted as skipped.
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

// Publishes a frame that leaves the last stage.
void StreamEngine::emit(const Frame& frame, EngineOut& out) noexcept {
  pose_.kind = Item::Kind::kFrame;
  pose_.frame = frame;
  const std::size_t last = time_stage(kMaxStages);
  pose_.frame.stage_us = stage_us_;
  has_pose_ = true;
  last_out_ = frame.header.sequence;
  out.item(pose_);
  time_stage(last);
}

void StreamEngine::on_sample(const Sample& sample, EngineOut& out) noexcept {
  shed_samples_until(sample.header.sequence, out);
  last_sample_ = sample.header.sequence;
  heard(sample.header.arrival_ns, out);
  other_.kind = Item::Kind::kSample;
  other_.sample = sample;
  out.item(other_);
}

// Data arrived: a stream that was silent has recovered.
void StreamEngine::heard(std::int64_t arrival_ns, EngineOut& out) noexcept {
  last_arrival_ns_ = arrival_ns;
  for (const auto& stage : stages_) stage->heard(arrival_ns);
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

// The earliest tick that a stage asks for; kNoTime_ns if none does.
std::int64_t StreamEngine::stages_due_ns() const noexcept {
  if (state_ != StreamState::kLive && state_ != StreamState::kStale) return kNoTime_ns;
  std::int64_t first_ns = kNoTime_ns;
  for (const auto& stage : stages_) {
    const std::int64_t due_ns = stage->next_due_ns();
    if (due_ns != kNoTime_ns && (first_ns == kNoTime_ns || due_ns < first_ns)) first_ns = due_ns;
  }
  return first_ns;
}

bool StreamEngine::any_performs() const noexcept {
  return std::ranges::any_of(stages_, [](const auto& stage) { return stage->performs(); });
}

std::int64_t StreamEngine::next_tick_ns() const noexcept {
  const std::int64_t stages_ns = stages_due_ns();
  const std::int64_t stale_ns = stale_due_ns();
  return stages_ns == kNoTime_ns ? stale_ns : std::min(stages_ns, stale_ns);
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
  const std::int64_t due_ns = stages_due_ns();
  const bool stages_tick = due_ns != kNoTime_ns && now_ns >= due_ns;
  const bool stale = !stages_tick || now_ns >= stale_due_ns();
  if (stages_tick) {
    stage_us_.fill(0.0F);
    for (std::size_t i = 0; i < stages_.size(); ++i) {
      const std::int64_t stage_due_ns = stages_[i]->next_due_ns();
      if (stage_due_ns == kNoTime_ns || now_ns < stage_due_ns) continue;
      Chain rest(*this, i + 1, out);
      const std::size_t before = time_stage(i);
      stages_[i]->tick(now_ns, rest);
      time_stage(before);
    }
    report_played(now_ns, out);
  }
  if (!stale) return;
  if (state_ == StreamState::kLive) {
    state_ = StreamState::kStale;
    event(v1::Event::KIND_STALE, now_ns, last_sequence_, seconds(now_ns - last_arrival_ns_), out);
  }
  next_held_ns_ = now_ns + kHeldEvery_ns;
  if (has_pose_ && !any_performs()) {
    pose_.kind = Item::Kind::kFrame;
    pose_.frame.quality = Quality::kStale;
    out.item(pose_);
  }
}

Ack StreamEngine::apply(const Command& command, EngineOut& out) noexcept {
  Ack ack{.ticket = command.ticket, .stream = options_.stream, .sequence = last_sequence_ + 1};
  Decision decision{.stream = options_.stream, .sequence = ack.sequence};
  StreamEvent change{options_.stream, v1::Event::KIND_CONTROL, last_arrival_ns_, 0, 0.0};
  describe(command, change);
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
  change.sequence = ack.sequence;
  other_.kind = Item::Kind::kEvent;
  other_.stream_event = change;
  out.item(other_);
  return ack;
}

// Describes in the event what the command is about to change.
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
  stage_us_.fill(0.0F);
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    Chain rest(*this, i + 1, out);
    stages_[i]->flush(rest);
  }
}

void StreamEngine::report_played(std::int64_t time_ns, EngineOut& out) noexcept {
  const bool performed = performs_;
  performs_ = any_performs();
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
