// LiveSmoother: the pipeline stage that smooths live frames. At every frame it solves for the most
// likely trajectory over the last frames (26 up to 60 Hz, 0.43 s above), given the measurements and
// a prior that widens where the hand moves fast (models/smooth/README.md, "Speed-adaptive prior").
// No gesture model is needed. It adds no latency beyond the chosen lag. Missing joints are bridged
// by the same solve.
//
// It works for every skeleton with rotation channels; with a gesture model of a body, whose joints
// are smoothed as the model's rotation vectors, for one without, too. A frame of another skeleton,
// or without angles, passes through at once, after the frames that still wait. Channels are
// unwrapped internally; root position and all other contents are those of the emitted frame.
//
// Times are the device's where a frame has them, else arrival times; they may be uneven, jump or
// run backwards. Constants are in radians and seconds, so any rate from 10 to 1000 Hz works without
// tuning. An optional gesture model names the gesture, bridges gaps within its own gestures and
// steadies poses that it knows; it does not disturb an unknown motion.
#pragma once

#include <cstdint>
#include <memory>

#include "models/smooth/live_model.hpp"
#include "models/smooth/live_options.hpp"
#include "models/stage.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::smooth {

class LiveSmoother final : public Stage {
 public:
  // Allocates all memory that it will use. `model` is bound to the same skeleton, not owned, and
  // may be null.
  LiveSmoother(const Skeleton& skeleton, const LiveOptions& options,
               const LiveModel* model = nullptr);
  ~LiveSmoother() override;

  // Emits none, one or several frames: those that are `lag` behind `in` and have not gone out. An
  // emitted frame keeps its own header, source, root and stamps; its angles, rotations, validity
  // and quality (predicted where something was bridged) are the solve's, lag_frames and lag_ms say
  // how far behind `in` it is; the posterior variance goes with it.
  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override;
  // After a silence it flushes.
  RT_SAFE void tick(std::int64_t now_ns, StageOut& out) noexcept override;

  // Emits the frames that still wait, with the little that is known of their future: end of stream,
  // or silence. The stream may go on after it.
  RT_SAFE void flush(StageOut& out) noexcept override;

  // Forgets the past; the next frame is treated as the first one.
  RT_SAFE void reset() noexcept;

  // Takes effect at the next frame; returns the previous model. Channels of a body are those of its
  // model, so the past is then forgotten.
  RT_SAFE const LiveModel* set_model(const LiveModel* model) noexcept;

  // Sensor noise in use [rad].
  RT_SAFE [[nodiscard]] double noise_rad() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace posed::smooth
