// The contract of a pipeline stage: style, generate, constrain and those still to come. A stream's
// engine runs its stages as a list; live, offline commands and replay use the same objects.
#pragma once

#include <cstdint>
#include <span>

#include "proto/frame/frame.hpp"

namespace posed {

// Stages a stream may have, and so the length of Frame::stage_us.
inline constexpr std::size_t kMaxStages = std::tuple_size_v<decltype(Frame::stage_us)>;

// What goes from stage to stage. It borrows: everything is valid during the call that hands it on.
struct StageFrame {
  const Frame& frame;
  // Posterior variance of the pose, one a rotation channel in the order of Frame::angle_rad
  // [rad^2]; infinite where nothing is known. Empty: no stage so far estimates it.
  std::span<const double> variance_rad2{};
  // The same frame as the source gave it. Null behind a stage that holds frames back or makes its
  // own: the source's frame is gone by then.
  const Frame* input = nullptr;
};

// Where a stage puts its frames: none, one or several a call. RT-safe.
class StageOut {
 public:
  StageOut() = default;
  StageOut(const StageOut&) = delete;
  StageOut& operator=(const StageOut&) = delete;
  virtual ~StageOut() = default;

  virtual void frame(const StageFrame& frame) noexcept = 0;
};

// One stage of one stream, with all its state. It knows frame times and the times of ticks, never a
// clock. All calls are RT-safe and come from one thread.
class Stage {
 public:
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
  virtual ~Stage() = default;

  virtual void process(const StageFrame& in, StageOut& out) noexcept = 0;

  // Something of the stream arrived, a frame or a sample: it is not silent. Called before
  // process().
  virtual void heard(std::int64_t /*arrival_ns*/) noexcept {}
  // When tick() is wanted if nothing arrives until then; kNoTime_ns: it is not.
  [[nodiscard]] virtual std::int64_t next_due_ns() const noexcept { return kNoTime_ns; }
  // Nothing has arrived until `now_ns`, at which the tick was due.
  virtual void tick(std::int64_t /*now_ns*/, StageOut& /*out*/) noexcept {}
  // No more frames arrive: those that the stage holds back go out. The stream may go on after it.
  virtual void flush(StageOut& /*out*/) noexcept {}
  // Whether it emits a motion of its own, with or without input: such a stream is not silent.
  [[nodiscard]] virtual bool performs() const noexcept { return false; }
};

}  // namespace posed
