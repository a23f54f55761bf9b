// NoiseEstimate: learns from the measured values what noise the sensors have: how strong it is, how
// far it is correlated from sample to sample, in which steps each channel is quantised, and which
// frames show a sample a second time (models/smooth/README.md, "Noise estimate"). Channels that
// never changed are left out. One thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/frame/rt_safe.hpp"

namespace posed::smooth {

// The median of sizes, from a histogram of their logarithms; its counts are halved when it is full,
// so that it follows the last values.
class MedianSize {
 public:
  RT_SAFE void count(double size_rad) noexcept;
  RT_SAFE void fade() noexcept;  // to be called once a frame
  RT_SAFE void reset() noexcept;
  RT_SAFE [[nodiscard]] double total() const noexcept { return total_; }
  RT_SAFE [[nodiscard]] double median_rad() const noexcept;

 private:
  static constexpr int kBinsAnOctave = 16;
  static constexpr int kOctaves = 24;
  static constexpr int kBins = kBinsAnOctave * kOctaves;

  std::array<double, kBins> bins_{};  // counts by the logarithm
  double total_ = 0.0;
};

class NoiseEstimate {
 public:
  explicit NoiseEstimate(int channels);

  // The next frame's channels [rad], NaN where missing. `even`: it follows the previous frame by
  // one period; `period_s` of the stream.
  RT_SAFE void push(std::span<const double> measured_rad, bool even, double period_s) noexcept;

  // The assumed noise [rad], as white noise that disturbs a motion as much as the sensors' does:
  // slightly below the estimate, because an assumed noise that is too low costs less accuracy than
  // one that is too high.
  RT_SAFE [[nodiscard]] double noise_rad() const noexcept { return noise_rad_; }
  // The same as far as it shows from sample to sample: less where the noise is correlated.
  RT_SAFE [[nodiscard]] double jitter_rad() const noexcept { return jitter_rad_; }
  // The noise of each channel over noise_rad().
  RT_SAFE [[nodiscard]] std::span<const double> share() const noexcept { return share_; }
  // The error of rounding [rad], for each channel; 0 where the values have no steps.
  RT_SAFE [[nodiscard]] std::span<const double> rounding_rad() const noexcept {
    return rounding_rad_;
  }
  // For each channel half a step [rad] where values are off by rounding alone, so that none is
  // farther from the truth; else infinite.
  RT_SAFE [[nodiscard]] std::span<const double> half_step_rad() const noexcept {
    return half_step_rad_;
  }
  // Whether the noise is known to be white: not correlated, without repeated samples. Needs some
  // hundred values.
  RT_SAFE [[nodiscard]] bool white() const noexcept { return white_; }
  // Whether the last frame shows the sample of the frame before once more.
  RT_SAFE [[nodiscard]] bool repeated() const noexcept { return repeated_; }
  // For each channel 1 where the last frame shows its sample once more, as the device does channel
  // by channel; not set by repeated().
  RT_SAFE [[nodiscard]] std::span<const std::uint8_t> again() const noexcept { return again_; }

  RT_SAFE void reset() noexcept;

 private:
  void judge_repeat(std::span<const double> measured_rad) noexcept;
  [[nodiscard]] bool shown_again(std::size_t c, double change_rad) noexcept;
  void learn_step(std::size_t c, double change_rad) noexcept;
  void learn_differences(std::size_t c, double now_rad) noexcept;
  void learn_level(std::size_t c, double third_rad, double tenth_rad) noexcept;
  [[nodiscard]] double own_share(std::size_t c, double common_rad) const noexcept;
  void forget_differences() noexcept;
  [[nodiscard]] double correlation() const noexcept;
  [[nodiscard]] double correlated_rad(double r, double period_s) const noexcept;

  static constexpr int kPast = 20;       // samples: the tenth difference of every second one
  static constexpr int kMaxRepeats = 4;  // of one sample

  // Median sizes of a channel's own differences, followed by small steps [rad]; 0: not begun.
  struct Level {
    double third_rad = 0.0, tenth_rad = 0.0;
    double values = 0.0;
  };

  struct Step {
    double least_rad = 0.0;  // the smallest change since it was found
    double multiples = 0.0;  // share of the changes that are multiples of it
    int changes = 0;
    double turns = 1.0;  // share of the changes that take back one of the last frames'
    double last_rad = 0.0;
    int frames = 0;  // since that change
  };

  // Whether a channel shows its samples more than once.
  struct Shown {
    double samples = 0.0;   // that the shares are means of
    double repeated = 0.0;  // share of the samples that were shown again
    double alike = 0.0;     // share of those that were shown as long as the one before
    int run = 0;            // frames that show the last sample again
    int last_run = 0;       // the same of the sample before
    int even = 0;           // samples in a row that are equally far apart, up to kPast
    bool more_than_once = false;
  };

  std::vector<double> past_;           // [channels][kPast] samples, newest first
  std::vector<double> first_;          // [channels] the first value of each
  std::vector<bool> moved_;            // [channels]
  std::vector<Step> steps_;            // [channels]
  std::vector<Level> levels_;          // [channels]
  std::vector<Shown> shown_;           // [channels]
  std::vector<std::uint8_t> again_;    // [channels]
  std::vector<double> share_;          // [channels]
  std::vector<double> rounding_rad_;   // [channels]
  std::vector<double> half_step_rad_;  // [channels]
  long number_ = 0;                    // of samples
  int even_samples_ = 0;               // in a row, up to kPast
  MedianSize third_, tenth_, far_tenth_;
  bool repeats_ = false;   // the device shows samples more than once
  bool repeated_ = false;  // the last frame was such
  int run_ = 0;            // frames without any change
  double samples_ = 0.0;   // that the shares are means of
  double alone_ = 0.0;     // share of the channels that repeat while others change
  std::array<double, kMaxRepeats> longer_{};  // share of the samples repeated more than i times
  double noise_rad_;
  double jitter_rad_;
  bool white_ = false;
};

}  // namespace posed::smooth
