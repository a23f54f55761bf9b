// How many frames a state lasts (models/perform/README.md, "State durations" and "Duration scale").
#pragma once

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::perform {

// floor(mean + rho variance + carried + 1/2), from 1 to a million; rho 0 gives natural durations,
// below 0 faster ones. `carried` is the frames that rounding took from earlier states.
RT_SAFE [[nodiscard]] int state_frames(double mean, double variance, double rho,
                                       double carried) noexcept;

// The rho at which the gesture's states (each at least one frame, not rounded) last as long as its
// natural frames (rho 0, rounded) divided by `tempo`, which is finite and above 0. 0 at tempo 1,
// and where no state's duration varies.
RT_SAFE [[nodiscard]] double tempo_rho(const gesture::DurationGaussian& duration,
                                       double tempo) noexcept;

}  // namespace posed::perform
