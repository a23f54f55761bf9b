// StreamEngine: everything between decoding and publishing for one stream, and nothing else: no
// thread, no clock, no ring. The live pipeline thread and `replay` drive the same object, so the
// same frames and decisions give the same bits.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "models/generate/generate_stage.hpp"
#include "models/stage.hpp"
#include "models/style/style_filter.hpp"

namespace posed::pipeline {

// Where an engine puts what it made. Items come in the order in which they are published; decisions
// are what replay must be told (see pipeline::RecordSink).
class EngineOut {
 public:
  EngineOut() = default;
  EngineOut(const EngineOut&) = delete;
  EngineOut& operator=(const EngineOut&) = delete;
  virtual ~EngineOut() = default;

  virtual void item(const Item& item) noexcept = 0;
  virtual void decision(const Decision& decision) noexcept = 0;
};

struct EngineOptions {
  std::uint32_t stream = 0;
  std::int64_t stale_after_ns = kNanosPerSecond / 2;
  bool publish_raw = false;
  std::optional<style::FilterOptions> style;      // the stage is there when this is
  const style::BoundModel* model = nullptr;       // not owned; null passes frames through
  std::optional<smooth::LiveOptions> generate{};  // the stage is there when this is; hands only
  const generate::BoundModel* gesture = nullptr;  // not owned; null: nothing can be performed
  bool constrain = false;                         // the stage is there; hands only
  double rate_hz = 0.0;                           // of the stream; only `generate` needs it
  std::shared_ptr<const Skeleton> skeleton{};  // of the stream; `generate` and `constrain` need it
  Clock clock = nullptr;                       // times the stages; null: not timed
};

// The stages that the options ask for, in the order in which the engine runs them.
[[nodiscard]] std::vector<std::string> stage_names(const EngineOptions& options);

// Runs the stages of one stream as a list. All calls come from one thread and are RT-safe, but for
// construction.
class StreamEngine final {
 public:
  explicit StreamEngine(const EngineOptions& options);

  // A decoded frame, stamped with stream, sequence and arrival. A gap since the last sequence is a
  // shed: decided and told before the frame itself.
  void on_frame(const Frame& frame, EngineOut& out) noexcept;
  // The same for a sample; its gaps are decided, but not told.
  void on_sample(const Sample& sample, EngineOut& out) noexcept;
  // What was decoded last, before flush() or end(): what is missing behind the last frame and
  // sample that came was shed, too.
  void close_gaps(std::uint64_t last_frame, std::uint64_t last_sample, EngineOut& out) noexcept;

  // Says that the time is `now_ns` when nothing came. Stages whose tick is due get it. Frames are
  // missing for stale_after: the stream turns stale, and the last pose goes out once a second with
  // quality stale, under its own old sequence and times. Returns whether anything happened; only
  // then is a decision emitted.
  bool tick(std::int64_t now_ns, EngineOut& out) noexcept;
  // The tick itself, for replay: the live run has decided that it was due.
  void tick_now(std::int64_t now_ns, EngineOut& out) noexcept;
  // When the next tick is due; kNoTime_ns while none is.
  [[nodiscard]] std::int64_t next_tick_ns() const noexcept;

  // Alpha and model take effect at the next frame that enters, a play at the next that leaves; its
  // sequence is in the Ack.
  [[nodiscard]] Ack apply(const Command& command, EngineOut& out) noexcept;

  // No more frames come: those that wait go out.
  void flush(EngineOut& out) noexcept;
  // The source will give no more: flushed; no longer stale, only ended. A decision.
  void end(std::int64_t now_ns, EngineOut& out) noexcept;

  [[nodiscard]] StreamState state() const noexcept { return state_; }
  [[nodiscard]] float alpha() const noexcept;         // where the slew is
  [[nodiscard]] float alpha_target() const noexcept;  // where it goes
  [[nodiscard]] const style::BoundModel* model() const noexcept { return model_; }
  [[nodiscard]] const generate::BoundModel* gesture() const noexcept {
    return generate_ ? generate_->model() : nullptr;
  }

 private:
  // Where the stage before `next` puts its frames.
  class Chain;

  void run(std::size_t next, const StageFrame& frame, EngineOut& out) noexcept;
  void emit(const Frame& frame, EngineOut& out) noexcept;
  std::size_t time_stage(std::size_t stage) noexcept;
  void report_played(std::int64_t time_ns, EngineOut& out) noexcept;
  void shed_until(std::uint64_t sequence, std::int64_t time_ns, EngineOut& out) noexcept;
  void shed_samples_until(std::uint64_t sequence, EngineOut& out) noexcept;
  [[nodiscard]] std::int64_t stale_due_ns() const noexcept;
  [[nodiscard]] std::int64_t stages_due_ns() const noexcept;
  [[nodiscard]] bool any_performs() const noexcept;
  void heard(std::int64_t arrival_ns, EngineOut& out) noexcept;
  void event(std::uint8_t event, std::int64_t time_ns, std::uint64_t sequence, double value,
             EngineOut& out) noexcept;
  void describe(const Command& command, StreamEvent& event) const noexcept;

  EngineOptions options_;
  std::vector<std::unique_ptr<Stage>> stages_;
  style::StyleFilter* style_ = nullptr;          // of them; null where it is not there
  generate::GenerateStage* generate_ = nullptr;  // the same
  const style::BoundModel* model_ = nullptr;
  StreamState state_ = StreamState::kWaiting;
  std::uint64_t last_sequence_ = 0;  // that entered
  std::uint64_t last_out_ = 0;       // that left
  std::uint64_t last_sample_ = 0;    // that entered
  std::int64_t last_arrival_ns_ = kNoTime_ns;
  std::int64_t next_held_ns_ = kNoTime_ns;
  // The stopwatch: which stage runs, since when, and what each has taken in this call.
  std::size_t timed_stage_ = kMaxStages;  // kMaxStages: none
  std::int64_t timed_since_ns_ = 0;
  std::array<float, kMaxStages> stage_us_{};
  bool performs_ = false;  // as last told
  bool has_pose_ = false;  // pose_ holds a pose that went out
  Item pose_;              // frames on their way out, and the last pose
  Item other_;             // samples and events on their way out
};

}  // namespace posed::pipeline
