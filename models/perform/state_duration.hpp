// How many frames a state lasts (models/perform/README.md, "State durations" and "Duration scale").
// All RT-safe.
#pragma once

#include "models/gesture/gesture_model.hpp"

namespace posed::perform {

inline constexpr double kMinTempo = 0.25, kMaxTempo = 4.0;

// max(1, floor(mean + rho variance + carried + 1/2)); rho 0 gives natural durations, below 0 faster
// ones. `carried` is the frames that rounding took from earlier states.
[[nodiscard]] int state_frames(double mean, double variance, double rho, double carried) noexcept;

// The rho at which the gesture's states (each at least one frame, not rounded) last as long as its
// natural frames (rho 0, rounded) divided by `tempo`, the duration scale. 0 at tempo 1.
[[nodiscard]] double tempo_rho(const gesture::DurationGaussian& duration, double tempo) noexcept;

}  // namespace posed::perform
