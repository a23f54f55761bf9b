// InteractingModels: two models of how one channel moves, weighed against each other by its
// measurements: the interacting multiple model filter (Blom and Bar-Shalom 1988;
// models/smooth/README.md, "Steady motion"). Both models are Kalman filters with constant velocity
// and differ in the density of the acceleration: loose where the speed may change, tight where it
// hardly does.
//
// For each frame: predict(), then, if the channel was measured, surprise() and weigh(). weigh() is
// apart so that the evidence of other channels can be added. Units: radians and seconds; densities
// are rad^2/s^3. RT-safe; a value type of one thread.
#pragma once

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
  // Takes a measurement in.
  Innovation update(double measured_rad, double variance_rad2) noexcept;
};

class InteractingModels {
 public:
  // How probable it is that the motion keeps its kind until the next frame.
  struct Stay {
    double loose, tight;
  };
  // Of the acceleration [rad^2/s^3].
  struct Density {
    double loose, tight;
  };

  // The first measurement; before it, only started() and loose() may be called.
  void start(double measured_rad, double variance_rad2) noexcept;
  [[nodiscard]] bool started() const noexcept { return started_; }

  void predict(double step_s, const Stay& stay, const Density& density) noexcept;
  // Takes a measurement in; returns the log of how much likelier it was under the loose model.
  double surprise(double measured_rad, double variance_rad2) noexcept;
  void weigh(double log_loose_over_tight) noexcept;

  // The probability of the loose model; 1 before start().
  [[nodiscard]] double loose() const noexcept { return loose_probability_; }

 private:
  ConstantVelocity loose_, tight_;
  double loose_probability_ = 1.0;
  bool started_ = false;
};

}  // namespace posed::smooth
