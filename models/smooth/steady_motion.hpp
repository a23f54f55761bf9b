// SteadyMotion: in which frames each channel's speed may change (models/smooth/README.md, "Steady
// motion"). The speed-adaptive prior expects a moving hand to accelerate and a slow one to stop. On
// a steady ramp it does neither: the one expectation only lets noise through, the other pulls on
// the ramp. So two models of the motion compete for each channel (InteractingModels), and the prior
// relaxes to the tight one where that explains the measurements better.
//
// Units: radians and seconds. All memory is allocated at construction; the rest is RT-safe. One
// thread.
#pragma once

#include <span>
#include <vector>

#include "models/smooth/interacting_models.hpp"
#include "models/trajectory/information_form.hpp"

namespace posed::smooth {

class SteadyMotion {
 public:
  // The fourth root of the acceleration's density in a steady motion [(rad^2/s^3)^(1/4)].
  static const double kDensityRoot;

  // Remembers `frames` frames; stride: the length of a row, at least `channels`.
  SteadyMotion(int channels, int stride, int frames);

  // What is known of the next frame's channels besides their values.
  struct Channels {
    double variance_rad2;   // of a measurement
    const double* density;  // [channels] that the speed-adaptive prior expects [rad^2/s^3]
    const double* active;   // [channels] 1 for those whose evidence counts for the whole hand
  };
  // The next frame: [channels] rad, NaN where missing. Times increase.
  void push(double time_s, std::span<const double> measured_rad, const Channels& known) noexcept;

  void reset() noexcept;

  // For each channel the probability that its speed changes at the frame `back` frames before the
  // newest as the speed-adaptive prior expects; 1 where it was not measured. [stride], 64-byte
  // aligned.
  [[nodiscard]] const double* loose(int back) const noexcept { return row(pushed_ - 1 - back); }

 private:
  [[nodiscard]] double* row(long frame) const noexcept {
    return loose_.get() + static_cast<std::ptrdiff_t>(frame % frames_) * stride_;
  }
  void follow(double step_s, std::span<const double> measured_rad, const Channels& known) noexcept;
  void remember(double time_s, std::span<const double> measured_rad) noexcept;

  int stride_, frames_;
  long pushed_ = 0;
  std::vector<InteractingModels> models_;  // [channels]
  std::vector<double> evidence_;           // [channels] log likelihood ratio of the newest frame
  std::vector<double> time_s_;             // [frames] ring
  trajectory::Rows loose_;                 // [frames][stride] ring
};

}  // namespace posed::smooth
