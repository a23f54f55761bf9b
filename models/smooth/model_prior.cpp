#include "models/smooth/model_prior.hpp"

#include <algorithm>
#include <utility>

namespace posed::smooth {
namespace {

using gesture::kDeltaWindows;

constexpr double kPull = 0.1;       // weight of the model's pose beside a measurement
constexpr double kGapPull = 0.3;    // and where the channel is missing
constexpr double kFit2 = 2.0;       // normalised squared distance at which the fit is one half
constexpr double kBelieved = 1e-3;  // states with a smaller probability are left out
constexpr double kMinModelVariance = 1e-12;

}  // namespace

ModelPrior::ModelPrior(const HmmForwardFilter& filter, int max_channels) : filter_(filter) {
  belief_.mean.resize(static_cast<std::size_t>(kDeltaWindows) *
                      static_cast<std::size_t>(max_channels));
  belief_.variance.resize(belief_.mean.size());
}

// Mean and variance of one frame over its state probabilities, of the position and, with `moving`,
// of delta and delta-delta, which only gaps need; false where the model believes in no state.
RT_SAFE bool ModelPrior::believe(int back, bool moving) noexcept {
  const LiveModel& model = *filter_.model();
  const auto states = filter_.states(back);
  const std::size_t channels = model.channels;
  const std::size_t windows = moving ? kDeltaWindows : 1;
  const std::size_t features = windows * channels;
  LiveRows& mean = belief_.mean;
  LiveRows& variance = belief_.variance;
  std::fill_n(mean.begin(), features, 0.0);
  std::fill_n(variance.begin(), features, 0.0);
  double sum = 0.0;
  for (std::size_t s = 0; s < states.size(); ++s) {
    const double share = states[s];
    if (share < kBelieved) continue;
    sum += share;
    const LiveState& state = model.states[s];
    for (std::size_t k = 0; k < features; ++k) {
      const double own = state.mean[k];
      mean[k] += share * own;
      variance[k] += share * (state.variance[k] + own * own);
    }
  }
  if (sum <= 0.0) return false;
  some_ = 1.0 - filter_.none(back);
  const RateFactors rule = rate_factors(filter_.pace());
  for (std::size_t w = 0; w < windows; ++w) {
    for (std::size_t k = w * channels; k < (w + 1) * channels; ++k) {
      const double m = mean[k] / sum;
      variance[k] = std::max(variance[k] / sum - m * m, kMinModelVariance) * rule.variance[w];
      mean[k] = m * rule.mean[w];
    }
  }
  return true;
}

RT_SAFE void ModelPrior::measure_distance(const AdaptiveWindow& window, int back) noexcept {
  const LiveModel& model = *filter_.model();
  const double* const x = window.x(back);
  std::array<double, gesture::kMaxGroups> sum{};
  std::array<double, gesture::kMaxGroups> channels{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(model.channels); ++c) {
    if (model.moves[c] == 0) continue;
    const auto group = static_cast<std::size_t>(model.group[c]);
    const double off = x[c] - belief_.mean[c];
    sum[group] += off * off / belief_.variance[c];
    channels[group] += 1.0;
  }
  for (std::size_t g = 0; g < static_cast<std::size_t>(model.groups); ++g) {
    belief_.distance2[g] = channels[g] > 0.0 ? sum[g] / channels[g] : 0.0;
  }
}

// How well each group follows the model's gestures in the frames where its first channel is
// measured.
RT_SAFE void ModelPrior::measure_fit(const AdaptiveWindow& window) noexcept {
  const LiveModel& model = *filter_.model();
  std::array<double, gesture::kMaxGroups> frames{};
  fit_.fill(0.0);
  for (int back = window.frames() - 1; back > 0; --back) {
    if (!filter_.knows(back) || !believe(back, false)) continue;
    measure_distance(window, back);
    int last = -1;
    for (int c = 0; c < model.channels; ++c) {
      const int group = model.group[c];
      if (std::exchange(last, group) == group || !window.measured(back, c)) continue;
      const std::size_t g = group;
      const double ratio = belief_.distance2[g] / kFit2;
      fit_[g] += 1.0 / (1.0 + ratio * ratio);
      frames[g] += 1.0;
    }
  }
  for (std::size_t g = 0; g < fit_.size(); ++g) fit_[g] /= std::max(frames[g], 1.0);
}

// Pulls towards the model's pose with its variance times (1 + e^2/2)^2, so that a group which is
// elsewhere is not disturbed.
RT_SAFE void ModelPrior::pull(AdaptiveWindow& window, int back) noexcept {
  const LiveModel& model = *filter_.model();
  std::array<double, gesture::kMaxGroups> weight{}, weight_in_gap{};
  for (std::size_t g = 0; g < static_cast<std::size_t>(model.groups); ++g) {
    const double wide = 1.0 + 0.5 * belief_.distance2[g];
    weight[g] = some_ * (kPull / (wide * wide));
    weight_in_gap[g] = some_ * (kGapPull * fit_[g]);
  }
  const bool whole = window.whole(back);
  double* const position = window.row(back, trajectory::kPosition);
  double* const position_mean = window.row(back, trajectory::kPositionMean);
  for (std::size_t c = 0; c < static_cast<std::size_t>(model.channels); ++c) {
    if (model.moves[c] == 0) continue;
    const bool measured = whole || window.measured(back, static_cast<int>(c));
    const auto group = static_cast<std::size_t>(model.group[c]);
    const double precision =
        (measured ? weight[group] : weight_in_gap[group]) / belief_.variance[c];
    position[c] += precision;
    position_mean[c] += precision * belief_.mean[c];
    if (!measured) bridge(window, back, c);
  }
}

// In a gap the gestures' own delta and delta-delta replace the adaptive prior in proportion to the
// group's fit.
RT_SAFE void ModelPrior::bridge(AdaptiveWindow& window, int back, std::size_t c) noexcept {
  const LiveModel& model = *filter_.model();
  const double fit = some_ * fit_[static_cast<std::size_t>(model.group[c])];
  constexpr std::array kPrecision{trajectory::kDelta, trajectory::kDeltaDelta};
  constexpr std::array kMean{trajectory::kDeltaMean, trajectory::kDeltaDeltaMean};
  for (std::size_t w = 0; w < 2; ++w) {
    const std::size_t k = (w + 1) * static_cast<std::size_t>(model.channels) + c;
    const double own = fit / belief_.variance[k];
    double& precision = window.row(back, kPrecision[w])[c];
    precision = (1.0 - fit) * precision + own;
    window.row(back, kMean[w])[c] = own * belief_.mean[k];
  }
}

// Nothing is added to the newest frame, because the features taken at it describe the frame before.
RT_SAFE void ModelPrior::add(AdaptiveWindow& window) noexcept {
  bool gap = false;
  for (int back = 0; back < window.frames(); ++back) gap = gap || !window.whole(back);
  if (gap) measure_fit(window);
  for (int back = window.frames() - 1; back > 0; --back) {
    if (!filter_.knows(back) || !believe(back, !window.whole(back))) continue;
    measure_distance(window, back);
    pull(window, back);
  }
}

}  // namespace posed::smooth
