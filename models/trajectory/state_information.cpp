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
    for (const auto& tree : model_->trees[s]) {
      std::vector<GroupRows>& group = leaves_[s].emplace_back();
      for (const gesture::GroupGaussian& leaf : tree.leaves) {
        GroupRows& rows = group.emplace_back();
        for (int w = 0; w < kDeltaWindows; ++w) {
          for (std::size_t c = 0; c < leaf.mean[w].size(); ++c) {
            const double precision = 1.0 / (scale.variance[w] * leaf.variance[w][c]);
            rows[2 * w].push_back(precision);
            rows[2 * w + 1].push_back(precision * scale.mean[w] * leaf.mean[w][c]);
          }
        }
      }
    }
  }
}

RT_SAFE void StateInformation::fill(const Context& context, int state,
                                    double* rows) const noexcept {
  const int channels = model_->channels();
  const int stride = padded(channels);
  for (int g = 0; g < std::ssize(model_->groups); ++g) {
    const GroupRows& leaf = leaves_[state][g][gesture::leaf_index(*model_, state, g, context)];
    const int first = model_->groups[g].first;
    for (int r = 0; r < kRows; ++r) std::ranges::copy(leaf[r], rows + r * stride + first);
  }
  for (int r = 0; r < kRows; ++r) {
    const double padding = r == kPosition ? 1.0 : 0.0;
    std::fill(rows + r * stride + channels, rows + (r + 1) * stride, padding);
  }
}

RT_SAFE DurationGaussian StateInformation::duration(const Context& context) const noexcept {
  const double r = rate_hz_ / model_->rate_hz;
  DurationGaussian duration = gesture::duration(*model_, context);
  for (double& mean : duration.mean) mean *= r;
  for (double& variance : duration.variance) variance *= r * r;
  return duration;
}

}  // namespace posed::trajectory
