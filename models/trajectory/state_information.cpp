#include "models/trajectory/state_information.hpp"

#include <algorithm>
#include <utility>

namespace posed::trajectory {
namespace {

using gesture::Context;
using gesture::DurationGaussian;
using gesture::kDeltaWindows;
using gesture::kStates;

// Factors on a model's mean and variance of each window at a rate r times its own.
struct WindowScale {
  std::array<double, kDeltaWindows> mean, variance;
};

WindowScale scale_of(double r) {
  return {{1.0, 1.0 / r, 1.0 / (r * r)}, {r, 1.0 / r, 1.0 / (r * r * r)}};
}

}  // namespace

StateInformation::StateInformation(std::shared_ptr<const gesture::GestureModel> model,
                                   double rate_hz)
    : model_(std::move(model)), rate_hz_(rate_hz) {
  const WindowScale scale = scale_of(rate_hz_ / model_->rate_hz);
  for (int s = 0; s < kStates; ++s) {
    for (int f = 0; f < kFingers; ++f) {
      for (const gesture::FingerGaussian& leaf : model_->trees[s][f].leaves) {
        FingerRows& rows = leaves_[s][f].emplace_back();
        for (int w = 0; w < kDeltaWindows; ++w) {
          for (int c = 0; c < kFingerChannels; ++c) {
            const double precision = 1.0 / (scale.variance[w] * leaf.variance[w][c]);
            rows[2 * w][c] = precision;
            rows[2 * w + 1][c] = precision * scale.mean[w] * leaf.mean[w][c];
          }
        }
      }
    }
  }
}

// RT-safe.
void StateInformation::fill(const Context& context, int state, double* rows) const noexcept {
  constexpr int kStride = padded(kHandChannels);
  for (int f = 0; f < kFingers; ++f) {
    const FingerRows& leaf = leaves_[state][f][gesture::leaf_index(*model_, state, f, context)];
    for (int r = 0; r < kRows; ++r) {
      std::ranges::copy(leaf[r], rows + r * kStride + f * kFingerChannels);
    }
  }
  for (int r = 0; r < kRows; ++r) {
    const double padding = r == kPosition ? 1.0 : 0.0;
    std::fill(rows + r * kStride + kHandChannels, rows + (r + 1) * kStride, padding);
  }
}

// RT-safe.
DurationGaussian StateInformation::duration(const Context& context) const noexcept {
  const double r = rate_hz_ / model_->rate_hz;
  DurationGaussian duration = gesture::duration(*model_, context);
  for (double& mean : duration.mean) mean *= r;
  for (double& variance : duration.variance) variance *= r * r;
  return duration;
}

}  // namespace posed::trajectory
