// NoiseEstimate: the sensors' noise, out of what they send. The third difference of a smooth motion
// is almost nothing, that of white noise has variance 20 R; its median over channels and the last
// few hundred frames' worth of values is little moved by the motion that is left
// (models/smooth/README.md, "Noise estimate"). Channels that never changed say nothing.
#pragma once

#include <array>
#include <span>
#include <vector>

namespace posed::smooth {

class NoiseEstimate {
 public:
  explicit NoiseEstimate(int channels);

  // The next frame's channels [rad], not a number where missing. `even`: it follows the one before
  // by one beat. RT-safe.
  void push(std::span<const double> measured_rad, bool even) noexcept;

  // A little below what was found, because too much trust costs less than too little. RT-safe.
  [[nodiscard]] double noise_rad() const noexcept { return noise_rad_; }

  void reset() noexcept;  // RT-safe

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
  int even_frames_ = 0;               // in a row, up to kOrder
  std::array<double, kBins> bins_{};  // counts of |third difference|, by its logarithm
  double total_ = 0.0;
  double noise_rad_;
};

}  // namespace posed::smooth
