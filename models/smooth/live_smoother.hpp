// LiveSmoother: the live generator's stage. Of the last frames (26 up to 60 Hz, 0.43 s above) it
// solves, at every frame anew, the smoothest trajectory under what the sensors measured, with a
// prior that widens where the hand moves fast (models/smooth/README.md, "Speed-adaptive prior"); no
// model is needed. The lag is what the operator chose and nothing more. Missing joints are bridged
// by the same solve.
//
// Serves every skeleton with rotation channels; a frame of another skeleton, or without angles,
// passes through at once after the frames that still waited. Channels are unwrapped inside; root
// position and whatever else a frame carries are those of the frame that goes out.
//
// Times: the device's where a frame has them, else arrival; they may be uneven, jump or run
// backwards. Constants are in radians and seconds, so any rate from 10 to 1000 Hz is served as it
// is. A gesture model, where one is set, names the gesture, bridges gaps in its own vocabulary and
// steadies poses that it knows; it leaves an unknown hand alone.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "models/smooth/live_model.hpp"
#include "models/smooth/live_options.hpp"
#include "models/stage.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::smooth {

class LiveSmoother final : public Stage {
 public:
  // Allocates all it will ever need. `model` is bound to the same skeleton, not owned, may be null.
  LiveSmoother(const Skeleton& skeleton, const LiveOptions& options,
               const LiveModel* model = nullptr);
  ~LiveSmoother() override;

  // Emits none, one or several frames: those that are `lag` behind `in` and have not gone out. An
  // emitted frame keeps its own header, source, root and stamps; its angles, rotations, validity
  // and quality (predicted where something was bridged) are the solve's, lag_frames and lag_ms say
  // how far behind `in` it is; the posterior variance goes with it. RT-safe.
  void process(const StageFrame& in, StageOut& out) noexcept override;
  // Silence: flushes. RT-safe.
  void tick(std::int64_t now_ns, StageOut& out) noexcept override;

  // Emits the frames that still wait, with the little that is known of their future: end of stream,
  // or silence. The stream may go on after it. RT-safe.
  void flush(StageOut& out) noexcept override;

  // Forgets the past: the next frame is a first one. RT-safe.
  void reset() noexcept;

  // From the next frame on; returns the model before. RT-safe.
  const LiveModel* set_model(const LiveModel* model) noexcept;

  // Sensor noise in use [rad]. RT-safe.
  [[nodiscard]] double noise_rad() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace posed::smooth
