#include "daemon/pipeline/stream_engine.hpp"

#include <algorithm>
#include <utility>

#include "posed/v1/posed.pb.h"
#include "proto/text/parameter.hpp"

namespace posed::pipeline {
namespace {

constexpr std::int64_t kHeldEvery_ns = kNanosPerSecond;

}  // namespace

StreamEngine::StreamEngine(EngineOptions options) : options_(std::move(options)) {
  for (const EngineStage& stage : options_.stages) {
    const auto& table = stage.type->parameters;
    for (std::size_t i = 0; i < table.size(); ++i) {
      if (table[i].live && has_number(table[i])) live_.push_back({stage.stage.get(), i});
    }
    for (std::size_t i = 0; i < stage.type->readings.size(); ++i) {
      readings_.push_back({stage.stage.get(), i});
    }
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
  if (next == options_.stages.size()) return emit(frame.frame, out);
  Chain rest(*this, next + 1, out);
  const std::size_t before = time_stage(next);
  options_.stages[next].stage->process(frame, rest);
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

Stage* StreamEngine::find(const StageType& type) const noexcept {
  for (const EngineStage& stage : options_.stages) {
    if (stage.type == &type) return stage.stage.get();
  }
  return nullptr;
}

void StreamEngine::on_frame(const Frame& frame, EngineOut& out) noexcept {
  const Header& header = frame.header;
  shed_until(header.sequence, header.arrival_ns, out);
  last_sequence_ = header.sequence;
  received(header.arrival_ns, out);
  if (options_.publish_raw) {
    pose_.kind = Item::Kind::kRawFrame;
    pose_.frame = frame;
    pose_.frame.header.sequence += added_;
    out.item(pose_);
  }
  stage_us_.fill(0.0F);
  run(0, {.frame = frame, .input = &frame}, out);
  report_stages(header.arrival_ns, out);
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

// Publishes a frame that leaves the last stage. A frame that a stage made while none came has the
// number of the last one that did: it gets its own, and those after it are moved on.
void StreamEngine::emit(const Frame& frame, EngineOut& out) noexcept {
  pose_.kind = Item::Kind::kFrame;
  pose_.frame = frame;
  std::uint64_t& sequence = pose_.frame.header.sequence;
  if (sequence + added_ <= last_out_) added_ = last_out_ + 1 - sequence;
  sequence += added_;
  const std::size_t last = time_stage(kMaxStages);
  pose_.frame.stage_us = stage_us_;
  has_pose_ = true;
  last_out_ = sequence;
  out.item(pose_);
  time_stage(last);
}

void StreamEngine::on_sample(const Sample& sample, EngineOut& out) noexcept {
  shed_samples_until(sample.header.sequence, out);
  last_sample_ = sample.header.sequence;
  received(sample.header.arrival_ns, out);
  other_.kind = Item::Kind::kSample;
  other_.sample = sample;
  out.item(other_);
}

void StreamEngine::on_partner(const PartnerFeed& feed, const Frame& frame,
                              EngineOut& out) noexcept {
  if (state_ != StreamState::kLive && state_ != StreamState::kStale) return;
  stage_us_.fill(0.0F);
  Chain rest(*this, feed.stage + 1, out);
  const std::size_t before = time_stage(feed.stage);
  options_.stages[feed.stage].stage->partner(feed.partner, {.frame = frame}, rest);
  time_stage(before);
  report_stages(last_arrival_ns_, out);
}

// Data arrived: a stream that was silent has recovered.
void StreamEngine::received(std::int64_t arrival_ns, EngineOut& out) noexcept {
  last_arrival_ns_ = arrival_ns;
  for (const EngineStage& stage : options_.stages) stage.stage->received(arrival_ns);
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
  for (const EngineStage& stage : options_.stages) {
    const std::int64_t due_ns = stage.stage->next_due_ns();
    if (due_ns != kNoTime_ns && (first_ns == kNoTime_ns || due_ns < first_ns)) first_ns = due_ns;
  }
  return first_ns;
}

bool StreamEngine::any_performs() const noexcept {
  return std::ranges::any_of(options_.stages,
                             [](const EngineStage& stage) { return stage.stage->performs(); });
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
    for (std::size_t i = 0; i < options_.stages.size(); ++i) {
      Stage& stage = *options_.stages[i].stage;
      const std::int64_t stage_due_ns = stage.next_due_ns();
      if (stage_due_ns == kNoTime_ns || now_ns < stage_due_ns) continue;
      Chain rest(*this, i + 1, out);
      const std::size_t before = time_stage(i);
      stage.tick(now_ns, rest);
      time_stage(before);
    }
    report_stages(now_ns, out);
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
  const bool leaving = command.change.kind == StageChange::Kind::kCommand;
  Ack ack{.ticket = command.ticket,
          .stream = options_.stream,
          .sequence = (leaving ? last_out_ : last_sequence_ + added_) + 1};
  out.decision({.kind = Decision::Kind::kChange,
                .stream = options_.stream,
                .sequence = last_sequence_ + 1,
                .change = command.change,
                .model_hash = command.model_hash,
                .command = command.command});
  StreamEvent event{options_.stream, v1::Event::KIND_CONTROL, last_arrival_ns_, ack.sequence, 0.0};
  event.change = command.change;
  Stage* const stage = find(*command.change.type);
  ack.refused = stage == nullptr || !change(*stage, command, event);
  if (ack.refused) return ack;
  performs_ = performs_ || any_performs();
  other_.kind = Item::Kind::kEvent;
  other_.stream_event = event;
  out.item(other_);
  notify(last_arrival_ns_, out);
  return ack;
}

// Makes the change and describes it in the event; false: refused, and nothing has changed.
bool StreamEngine::change(Stage& stage, const Command& command, StreamEvent& event) noexcept {
  const StageChange& change = command.change;
  switch (change.kind) {
    case StageChange::Kind::kSet:
      event.value_before = stage.state(change.index).target;
      stage.set(change.index, change.value);
      return true;
    case StageChange::Kind::kModel:
      if (stage.model() != nullptr) event.before = ShortText(stage.model()->name);
      if (command.model != nullptr) event.after = ShortText(command.model->name);
      return stage.use(command.model);
    case StageChange::Kind::kCommand:
      stage.describe(change.index, command.command, event.after);
      if (change.type->commands[change.index].performs) event.kind = v1::Event::KIND_PLAYING;
      return stage.command(change.index, command.command);
  }
  return false;
}

void StreamEngine::flush(EngineOut& out) noexcept {
  stage_us_.fill(0.0F);
  for (std::size_t i = 0; i < options_.stages.size(); ++i) {
    Chain rest(*this, i + 1, out);
    options_.stages[i].stage->flush(rest);
  }
  notify(last_arrival_ns_, out);
}

// What the stages have to tell people.
void StreamEngine::notify(std::int64_t time_ns, EngineOut& out) noexcept {
  for (const EngineStage& stage : options_.stages) {
    while (const auto notice = stage.stage->take_notice()) {
      const StageNoticeType& type = stage.type->notices[notice->index];
      const int kind = type.is_warning ? v1::Event::KIND_WARNING : v1::Event::KIND_CALIBRATED;
      other_.kind = Item::Kind::kEvent;
      other_.stream_event = {options_.stream, static_cast<std::uint8_t>(kind), time_ns,
                             last_sequence_ + added_, 0.0};
      other_.stream_event.notice = type.sentence;
      out.item(other_);
    }
  }
}

// What has come of the stages' work: what they tell, and that a performance is over.
void StreamEngine::report_stages(std::int64_t time_ns, EngineOut& out) noexcept {
  notify(time_ns, out);
  const bool performed = performs_;
  performs_ = any_performs();
  if (performed && !performs_) event(v1::Event::KIND_PLAYED, time_ns, last_out_ - added_, 0.0, out);
}

void StreamEngine::end(std::int64_t now_ns, bool leaves, EngineOut& out) noexcept {
  out.decision({.kind = Decision::Kind::kEnd,
                .stream = options_.stream,
                .sequence = last_sequence_ + 1,
                .now_ns = now_ns});
  flush(out);
  state_ = StreamState::kEnded;
  other_.kind = Item::Kind::kEvent;
  other_.stream_event = {.stream = options_.stream,
                         .kind = v1::Event::KIND_ENDED,
                         .time_ns = now_ns,
                         .sequence = last_sequence_ + added_,
                         .leaves = leaves};
  out.item(other_);
}

void StreamEngine::event(std::uint8_t event, std::int64_t time_ns, std::uint64_t entered,
                         double value, EngineOut& out) noexcept {
  other_.kind = Item::Kind::kEvent;
  other_.stream_event = {options_.stream, event, time_ns, entered + added_, value};
  out.item(other_);
}

}  // namespace posed::pipeline
