// StreamEngine does everything between decoding and publishing for one stream, and nothing else: it
// has no thread, no clock and no ring. The live pipeline thread and `replay` drive the same object,
// so the same frames and decisions give the same bits.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/system/stale.hpp"
#include "models/stage_type.hpp"

namespace posed::pipeline {

// Receives the output of an engine. Items come in the order in which they are published. Decisions
// are what replay must read from the log (see pipeline::RecordSink).
class EngineOut {
 public:
  EngineOut() = default;
  EngineOut(const EngineOut&) = delete;
  EngineOut& operator=(const EngineOut&) = delete;
  virtual ~EngineOut() = default;

  virtual void item(const Item& item) noexcept = 0;
  virtual void decision(const Decision& decision) noexcept = 0;
};

struct EngineStage {
  const StageType* type;  // each at most once
  std::unique_ptr<Stage> stage;
};

// A stage gets the frames of another stream.
struct PartnerFeed {
  std::uint32_t stream = 0;  // id of the partner
  std::size_t stage = 0;     // index in EngineOptions::stages
  std::size_t partner = 0;   // index in StageType::partners
};

struct EngineOptions {
  std::uint32_t stream = 0;
  std::int64_t stale_after_ns = nanoseconds(system::kStaleAfter_s);
  bool publish_raw = false;
  std::vector<EngineStage> stages{};  // in the order in which they run
  std::vector<PartnerFeed> feeds{};
  Clock clock = nullptr;  // to time the stages; null: they are not timed
};

// Runs the stages of one stream as a list. All calls come from one thread and are RT-safe, except
// for construction.
class StreamEngine final {
 public:
  explicit StreamEngine(EngineOptions options);

  // Call before the first frame and sample: these are their sequences, because earlier ones belong
  // to the stream of the same name before it.
  void start_at(std::uint64_t frame, std::uint64_t sample) noexcept {
    last_sequence_ = last_out_ = frame - 1;
    last_sample_ = sample - 1;
  }

  // A decoded frame, stamped with stream, sequence and arrival. If sequences are missing before it,
  // they are recorded as shed and reported before the frame itself.
  void on_frame(const Frame& frame, EngineOut& out) noexcept;
  // The same for a sample; missing samples are recorded as a decision, but no event reports them.
  void on_sample(const Sample& sample, EngineOut& out) noexcept;
  // A frame that a partner has just published. Ignored before the first frame or sample of the
  // stream's own, so that it does not matter since when the engine exists.
  void on_partner(const PartnerFeed& feed, const Frame& frame, EngineOut& out) noexcept;
  [[nodiscard]] const std::vector<PartnerFeed>& feeds() const noexcept { return options_.feeds; }
  // Call before flush() or end(), with the sequences that were decoded last: frames and samples
  // that are missing after the last ones seen are recorded as shed, too.
  void close_gaps(std::uint64_t last_frame, std::uint64_t last_sample, EngineOut& out) noexcept;

  // Call when nothing has arrived until `now_ns`. Calls the stages whose tick is due. If frames
  // have been missing for stale_after, the stream becomes stale, and the last pose is published
  // once a second with quality stale and with its old sequence and times. Returns whether anything
  // happened; only then a decision is emitted.
  bool tick(std::int64_t now_ns, EngineOut& out) noexcept;
  // Does the tick without asking whether it is due; for replay, where the live run decided that.
  void tick_now(std::int64_t now_ns, EngineOut& out) noexcept;
  // When the next tick is due; kNoTime_ns while none is.
  [[nodiscard]] std::int64_t next_tick_ns() const noexcept;

  // Parameters and models take effect at the next frame that enters, commands of a stage at the
  // next frame that leaves; the Ack holds its sequence. A change to a stage that the stream does
  // not have is refused.
  [[nodiscard]] Ack apply(const Command& command, EngineOut& out) noexcept;

  // No more frames come: the stages emit the frames that they hold back.
  void flush(EngineOut& out) noexcept;
  // Nothing comes any more: flushes the stages and sets the state to ended. Emits a decision.
  // `leaves` as in StreamEvent.
  void end(std::int64_t now_ns, bool leaves, EngineOut& out) noexcept;

  [[nodiscard]] StreamState state() const noexcept { return state_; }
  // The number of the last frame that left the stages.
  RT_SAFE [[nodiscard]] std::uint64_t last_out() const noexcept { return last_out_; }
  // The live parameters of all stages, in their order.
  [[nodiscard]] std::size_t live_parameters() const noexcept { return live_.size(); }
  [[nodiscard]] ParameterState live_parameter(std::size_t i) const noexcept {
    return live_[i].stage->state(live_[i].index);
  }
  // What the stages measure, in their order.
  [[nodiscard]] std::size_t readings() const noexcept { return readings_.size(); }
  [[nodiscard]] double reading(std::size_t i) const noexcept {
    return readings_[i].stage->reading(readings_[i].index);
  }
  // Null if the stream does not have it.
  [[nodiscard]] Stage* find(const StageType& type) const noexcept;

  [[nodiscard]] std::uint32_t stream() const noexcept { return options_.stream; }

 private:
  // Hands the output of one stage to the next, `next`.
  class Chain;

  void run(std::size_t next, const StageFrame& frame, EngineOut& out) noexcept;
  void emit(const Frame& frame, EngineOut& out) noexcept;
  std::size_t time_stage(std::size_t stage) noexcept;
  void notify(std::int64_t time_ns, EngineOut& out) noexcept;
  void report_stages(std::int64_t time_ns, EngineOut& out) noexcept;
  void shed_until(std::uint64_t sequence, std::int64_t time_ns, EngineOut& out) noexcept;
  void shed_samples_until(std::uint64_t sequence, EngineOut& out) noexcept;
  [[nodiscard]] std::int64_t stale_due_ns() const noexcept;
  [[nodiscard]] std::int64_t stages_due_ns() const noexcept;
  [[nodiscard]] bool any_performs() const noexcept;
  void received(std::int64_t arrival_ns, EngineOut& out) noexcept;
  // `entered`: the number as of a frame that came in.
  void event(std::uint8_t event, std::int64_t time_ns, std::uint64_t entered, double value,
             EngineOut& out) noexcept;
  [[nodiscard]] bool change(Stage& stage, const Command& command, StreamEvent& event) noexcept;

  // A live parameter or a reading of a stage, by its number in the StageType.
  struct StageValue {
    const Stage* stage;
    std::size_t index;
  };

  EngineOptions options_;
  std::vector<StageValue> live_;
  std::vector<StageValue> readings_;
  StreamState state_ = StreamState::kWaiting;
  std::uint64_t last_sequence_ = 0;  // of the last frame that entered
  std::uint64_t last_out_ = 0;       // of the last frame that left
  // By how much numbers grow on their way out: the frames that stages have made while none came.
  std::uint64_t added_ = 0;
  std::uint64_t last_sample_ = 0;  // of the last sample that entered
  std::int64_t last_arrival_ns_ = kNoTime_ns;
  std::int64_t next_held_ns_ = kNoTime_ns;
  // Timing: which stage is running, since when, and how long each has taken in this call.
  std::size_t timed_stage_ = kMaxStages;  // kMaxStages: none
  std::int64_t timed_since_ns_ = 0;
  std::array<float, kMaxStages> stage_us_{};
  bool performs_ = false;  // as last reported
  bool has_pose_ = false;  // pose_ holds a pose that was published
  Item pose_;              // the frame on its way out; afterwards the last pose
  Item other_;             // the sample or event on its way out
};

// Copies the engine's live parameters and readings to where `stats` reads them.
RT_SAFE inline void publish_values(const StreamEngine& engine,
                                   PipelineCounters& counters) noexcept {
  for (std::size_t i = 0; i < engine.live_parameters(); ++i) {
    const ParameterState state = engine.live_parameter(i);
    counters.parameter[i].now.store(state.now, std::memory_order_relaxed);
    counters.parameter[i].target.store(state.target, std::memory_order_relaxed);
  }
  for (std::size_t i = 0; i < engine.readings(); ++i) {
    counters.reading[i].now.store(engine.reading(i), std::memory_order_relaxed);
  }
}

}  // namespace posed::pipeline
