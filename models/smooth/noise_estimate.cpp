#include "models/smooth/noise_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "proto/frame/degree.hpp"

namespace posed::smooth {
namespace {

constexpr double kFirstGuess_rad = 1.0 * kDegree;  // used until there are enough values
constexpr double kMinNoise_rad = 0.02 * kDegree;
constexpr double kMinBin_rad = 1e-6;  // the first bin's lower edge
constexpr double kEnough = 40.0;      // values needed before the median is used
constexpr double kMemory = 12000.0;   // values; when reached, all counts are halved
constexpr double kLowSide = 0.97;
// The median of |third difference| of white noise is 0.6745 standard deviations, and that standard
// deviation is sqrt(20) times the noise.
constexpr double kToNoise = kLowSide / (0.6745 * 4.47213595499958);

}  // namespace

NoiseEstimate::NoiseEstimate(int channels)
    : channels_(channels), past_(kOrder * channels), first_(channels), moved_(channels) {
  reset();
}

RT_SAFE void NoiseEstimate::reset() noexcept {
  std::ranges::fill(first_, std::numeric_limits<double>::quiet_NaN());
  std::fill(moved_.begin(), moved_.end(), false);
  even_frames_ = 0;
  bins_.fill(0.0);
  total_ = 0.0;
  noise_rad_ = kFirstGuess_rad;
}

RT_SAFE void NoiseEstimate::push(std::span<const double> measured_rad, bool even) noexcept {
  even_frames_ = even ? std::min(even_frames_ + 1, kOrder) : 0;
  const std::size_t channels = channels_;
  for (std::size_t c = 0; c < channels; ++c) {
    const double now = measured_rad[c];
    if (std::isnan(first_[c])) first_[c] = now;
    if (std::isfinite(now) && now != first_[c]) moved_[c] = true;
    double* const past = past_.data() + c * kOrder;
    const double third = now - 3.0 * past[0] + 3.0 * past[1] - past[2];
    if (even_frames_ == kOrder && moved_[c] && std::isfinite(third)) count(std::abs(third));
    past[2] = past[1];
    past[1] = past[0];
    past[0] = now;
  }
  if (total_ >= kEnough) noise_rad_ = std::max(kMinNoise_rad, kToNoise * median_rad());
  if (total_ >= kMemory) {
    for (double& bin : bins_) bin *= 0.5;
    total_ *= 0.5;
  }
}

RT_SAFE void NoiseEstimate::count(double size_rad) noexcept {
  const double octaves = size_rad > kMinBin_rad ? std::log2(size_rad / kMinBin_rad) : 0.0;
  const int bin = std::min(static_cast<int>(octaves * kBinsAnOctave), kBins - 1);
  bins_[static_cast<std::size_t>(bin)] += 1.0;
  total_ += 1.0;
}

RT_SAFE double NoiseEstimate::median_rad() const noexcept {
  double below = 0.0;
  int bin = 0;
  for (; bin < kBins - 1; ++bin) {
    const double here = bins_[static_cast<std::size_t>(bin)];
    if (below + here >= 0.5 * total_) break;
    below += here;
  }
  const double here = bins_[static_cast<std::size_t>(bin)];
  const double inside = here > 0.0 ? (0.5 * total_ - below) / here : 0.5;
  return kMinBin_rad * std::exp2((bin + inside) / kBinsAnOctave);
}

}  // namespace posed::smooth
