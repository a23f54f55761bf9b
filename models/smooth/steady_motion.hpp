// SteadyMotion: in which frames each channel's speed may change (models/smooth/README.md, "Steady
// motion"). The speed-adaptive prior expects a moving hand to accelerate and a slow one to stop. On
// a steady ramp both assumptions are wrong: the first passes noise, the second biases the ramp. So
// two models of the motion compete for each channel (InteractingModels), and the prior relaxes to
// the tight one where that explains the measurements better.
//
// Units: radians and seconds. All memory is allocated at construction; the rest is RT-safe. One
// thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "models/trajectory/information_form.hpp"

namespace posed::smooth {

// Position and velocity as a Gaussian.
struct ConstantVelocity {
  double x = 0.0, v = 0.0;              // rad, rad/s
  double xx = 0.0, xv = 0.0, vv = 0.0;  // covariance

  // A measurement's expected variance, and the square of its distance from the prediction over it.
  struct Innovation {
    double variance, distance2;
  };

  void predict(double step_s, double density) noexcept;
  // Corrects the state by a measurement.
  Innovation update(double measured_rad, double variance_rad2) noexcept;
};

// Two models of how one channel moves, weighed against each other by its
// measurements: the interacting multiple model filter (Blom and Bar-Shalom 1988;
// models/smooth/README.md, "Steady motion"). Both models are Kalman filters with constant velocity
// and differ in the density of the acceleration: loose where the speed may change, tight where it
// hardly does.
//
// For each frame: predict(), then, if the channel was measured, surprise() and weigh(). weigh() is
// apart so that the evidence of other channels can be added. Units: radians and seconds; densities
// are rad^2/s^3. RT-safe; a value type of one thread.
class InteractingModels {
 public:
  // How probable it is that the motion keeps its kind until the next frame.
  struct Stay {
    double loose, tight;
  };
  // Spectral density of the acceleration [rad^2/s^3].
  struct Density {
    double loose, tight;
  };

  // The first measurement; before it, only started() and loose() may be called.
  void start(double measured_rad, double variance_rad2) noexcept;
  [[nodiscard]] bool started() const noexcept { return started_; }

  void predict(double step_s, const Stay& stay, const Density& density) noexcept;
  // Corrects both models by a measurement; returns the log of how much likelier it was under the
  // loose model.
  double surprise(double measured_rad, double variance_rad2) noexcept;
  void weigh(double log_loose_over_tight) noexcept;

  // The probability of the loose model; 1 before start().
  [[nodiscard]] double loose() const noexcept { return loose_probability_; }

 private:
  ConstantVelocity loose_, tight_;
  double loose_probability_ = 1.0;
  bool started_ = false;
};

class SteadyMotion {
 public:
  // The fourth root of the acceleration's density in a steady motion [(rad^2/s^3)^(1/4)].
  static const double kDensityRoot;

  // Remembers `frames` frames; stride: the length of a row, at least `channels`.
  SteadyMotion(int channels, int stride, int frames);

  // What is known of the next frame's channels besides their values.
  struct Channels {
    const double* variance_rad2;  // [channels] of a measurement
    const double* density;        // [channels] that the speed-adaptive prior expects [rad^2/s^3]
    const double* active;         // [channels] 1 for those whose evidence counts for the whole hand
    bool repeated = false;        // the values are those of the frame before once more
    std::span<const std::uint8_t> again{};  // [channels] 1: the same of one channel; empty: of none
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
