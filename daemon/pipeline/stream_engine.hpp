// StreamEngine: everything between decoding and publishing for one stream, and nothing else: no
// thread, no clock, no ring. The live pipeline thread and `replay` drive the same object, so the
// same frames and decisions give the same bits.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "models/style/style_filter.hpp"
#include "proto/frame/sink.hpp"

namespace posed::pipeline {

// Where an engine puts what it made. Items come in the order in which they are published; decisions
// are what replay must be told (see record::Tape).
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
  std::optional<style::FilterOptions> style;  // the stage is there when this is
  const style::BoundModel* model = nullptr;   // not owned; null passes frames through
};

// All calls come from one thread and are RT-safe, but for construction.
class StreamEngine final : private Emit {
 public:
  explicit StreamEngine(const EngineOptions& options) noexcept;

  // A decoded frame, stamped with stream, sequence and arrival. A gap since the last sequence is a
  // shed: decided and told before the frame itself.
  void on_frame(const Frame& frame, EngineOut& out) noexcept;
  void on_sample(const Sample& sample, EngineOut& out) noexcept;

  // Says that the time is `now_ns` when nothing came. Frames are missing for stale_after: the
  // stream turns stale, and the last pose goes out once a second with quality stale, under its own
  // old sequence and times. Returns whether anything happened; only then is a decision emitted.
  bool tick(std::int64_t now_ns, EngineOut& out) noexcept;
  // The tick itself, for replay: the live run has decided that it was due.
  void tick_now(std::int64_t now_ns, EngineOut& out) noexcept;
  // When the next tick is due; kNoTime_ns while none is.
  [[nodiscard]] std::int64_t next_tick_ns() const noexcept;

  // Alpha and model take effect at the next frame; its sequence is in the Ack.
  [[nodiscard]] Ack apply(const Command& command, EngineOut& out) noexcept;

  // The source will give no more: no longer stale, only ended.
  void end(std::int64_t now_ns, EngineOut& out) noexcept;

  [[nodiscard]] StreamState state() const noexcept { return state_; }
  [[nodiscard]] float alpha() const noexcept;  // where the slew is
  [[nodiscard]] const style::BoundModel* model() const noexcept { return model_; }

 private:
  void frame(const Frame& frame) noexcept override;  // what the last stage emitted
  void heard(std::int64_t arrival_ns, EngineOut& out) noexcept;
  void notice(std::uint8_t event, std::int64_t time_ns, std::uint64_t sequence, double value,
              EngineOut& out) noexcept;

  EngineOptions options_;
  std::optional<style::StyleFilter> style_;
  const style::BoundModel* model_ = nullptr;
  StreamState state_ = StreamState::kWaiting;
  std::uint64_t last_sequence_ = 0;
  std::int64_t last_arrival_ns_ = kNoTime_ns;
  std::int64_t next_held_ns_ = kNoTime_ns;
  EngineOut* out_ = nullptr;  // of the call in progress
  bool has_pose_ = false;     // pose_ holds a pose that went out
  Item pose_;                 // frames on their way out, and the last pose
  Item other_;                // samples and notices on their way out
};

}  // namespace posed::pipeline
