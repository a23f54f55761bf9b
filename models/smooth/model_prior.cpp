#include "models/smooth/model_prior.hpp"

#include <algorithm>

namespace posed::smooth {
namespace {

using gesture::kDeltaWindows;

constexpr double kPull = 0.1;       // weight of the model's pose beside a measurement
constexpr double kGapPull = 0.3;    // and where the channel is missing
constexpr double kFit2 = 2.0;       // normalised squared distance at which the fit is one half
constexpr double kBelieved = 1e-3;  // states with a smaller probability are left out
constexpr double kLeastVariance = 1e-12;

}  // namespace

// Mean and variance of one frame over its state probabilities. RT-safe.
void ModelPrior::believe(int back) noexcept {
  const LiveModel& model = *filter_.model();
  const auto states = filter_.states(back);
  HandRows& mean = belief_.mean;
  HandRows& variance = belief_.variance;
  mean = {};
  variance = {};
  double sum = 0.0;
  for (std::size_t s = 0; s < states.size(); ++s) {
    const double share = states[s];
    if (share < kBelieved) continue;
    sum += share;
    const LiveState& state = model.states[s];
    for (std::size_t w = 0; w < kDeltaWindows; ++w) {
      for (std::size_t c = 0; c < kHandChannels; ++c) {
        const double own = state.mean[w][c];
        mean[w][c] += share * own;
        variance[w][c] += share * (state.variance[w][c] + own * own);
      }
    }
  }
  const RateFactors rule = rate_factors(filter_.pace());
  for (std::size_t w = 0; w < kDeltaWindows; ++w) {
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      const double m = mean[w][c] / sum;
      variance[w][c] = std::max(variance[w][c] / sum - m * m, kLeastVariance) * rule.variance[w];
      mean[w][c] = m * rule.mean[w];
    }
  }
}

// RT-safe.
void ModelPrior::measure_distance(const AdaptiveWindow& window, int back) noexcept {
  const double* const x = window.x(back);
  for (std::size_t f = 0; f < kFingers; ++f) {
    double sum = 0.0;
    double channels = 0.0;
    for (std::size_t c = f * kFingerChannels; c < (f + 1) * kFingerChannels; ++c) {
      if (!filter_.model()->moves[c]) continue;
      const double off = x[c] - belief_.mean[0][c];
      sum += off * off / belief_.variance[0][c];
      channels += 1.0;
    }
    belief_.distance2[f] = channels > 0.0 ? sum / channels : 0.0;
  }
}

// How well each finger follows the model's gestures in the frames where it is measured. RT-safe.
void ModelPrior::measure_fit(const AdaptiveWindow& window) noexcept {
  std::array<double, kFingers> frames{};
  fit_.fill(0.0);
  for (int back = window.frames() - 1; back > 0; --back) {
    if (!filter_.knows(back)) continue;
    believe(back);
    measure_distance(window, back);
    for (std::size_t f = 0; f < kFingers; ++f) {
      if (!window.measured(back, static_cast<int>(f) * kFingerChannels)) continue;
      const double ratio = belief_.distance2[f] / kFit2;
      fit_[f] += 1.0 / (1.0 + ratio * ratio);
      frames[f] += 1.0;
    }
  }
  for (std::size_t f = 0; f < kFingers; ++f) fit_[f] /= std::max(frames[f], 1.0);
}

// Pulls towards the model's pose with its variance times (1 + e^2/2)^2, so that a finger which is
// elsewhere is not disturbed. RT-safe.
void ModelPrior::pull(AdaptiveWindow& window, int back, int channel) noexcept {
  const auto c = static_cast<std::size_t>(channel);
  const std::size_t finger = c / kFingerChannels;
  const double wide = 1.0 + 0.5 * belief_.distance2[finger];
  const double weight =
      window.measured(back, channel) ? kPull / (wide * wide) : kGapPull * fit_[finger];
  const double precision = weight / belief_.variance[0][c];
  window.row(back, trajectory::kPosition)[c] += precision;
  window.row(back, trajectory::kPositionMean)[c] += precision * belief_.mean[0][c];
}

// In a gap the gestures' own delta and delta-delta replace the adaptive prior in proportion to the
// finger's fit. RT-safe.
void ModelPrior::bridge(AdaptiveWindow& window, int back, int channel) noexcept {
  const auto c = static_cast<std::size_t>(channel);
  const double fit = fit_[c / kFingerChannels];
  constexpr std::array kPrecision{trajectory::kDelta, trajectory::kDeltaDelta};
  constexpr std::array kMean{trajectory::kDeltaMean, trajectory::kDeltaDeltaMean};
  for (std::size_t w = 0; w < 2; ++w) {
    const double own = fit / belief_.variance[w + 1][c];
    double& precision = window.row(back, kPrecision[w])[c];
    precision = (1.0 - fit) * precision + own;
    window.row(back, kMean[w])[c] = own * belief_.mean[w + 1][c];
  }
}

// Nothing is added to the newest frame, because the features taken at it describe the frame before.
// RT-safe.
void ModelPrior::add(AdaptiveWindow& window) noexcept {
  const LiveModel& model = *filter_.model();
  bool gap = false;
  for (int back = 0; back < window.frames(); ++back) gap = gap || !window.whole(back);
  if (gap) measure_fit(window);
  for (int back = window.frames() - 1; back > 0; --back) {
    if (!filter_.knows(back)) continue;
    believe(back);
    measure_distance(window, back);
    for (int c = 0; c < kHandChannels; ++c) {
      if (!model.moves[static_cast<std::size_t>(c)]) continue;
      pull(window, back, c);
      if (!window.measured(back, c)) bridge(window, back, c);
    }
  }
}

}  // namespace posed::smooth
