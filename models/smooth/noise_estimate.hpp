// NoiseEstimate: estimates the sensors' noise from the measured values. The third difference of a
// smooth motion is almost zero; that of white noise of variance R has variance 20 R. Its median
// over channels and the last 12,000 values is little affected by the remaining motion
// (models/smooth/README.md, "Noise estimate"). Channels that never changed are left out. One
// thread.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "proto/frame/rt_safe.hpp"

namespace posed::smooth {

class NoiseEstimate {
 public:
  explicit NoiseEstimate(int channels);

  // The next frame's channels [rad], NaN where missing. `even`: it follows the previous frame by
  // one period.
  RT_SAFE void push(std::span<const double> measured_rad, bool even) noexcept;

  // The assumed noise [rad]: slightly below the estimate, because an assumed noise that is too low
  // costs less accuracy than one that is too high.
  RT_SAFE [[nodiscard]] double noise_rad() const noexcept { return noise_rad_; }

  RT_SAFE void reset() noexcept;

 private:
  void count(double size_rad) noexcept;
  [[nodiscard]] double median_rad() const noexcept;

  static constexpr int kOrder = 3;
  static constexpr int kBinsAnOctave = 16;
  static constexpr int kOctaves = 24;
  static constexpr int kBins = kBinsAnOctave * kOctaves;

  int channels_;
  std::vector<double> past_;          // [kOrder x channels], newest first
  std::vector<double> first_;         // [channels] the first value of each
  std::vector<bool> moved_;           // [channels]
  int even_frames_ = 0;               // consecutive even frames, up to kOrder
  std::array<double, kBins> bins_{};  // counts of |third difference|, by its logarithm
  double total_ = 0.0;
  double noise_rad_;
};

}  // namespace posed::smooth
