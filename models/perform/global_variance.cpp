#include "models/perform/global_variance.hpp"

#include <algorithm>
#include <cmath>

namespace posed::perform {
namespace {

struct Moments {
  double sum = 0.0, squares = 0.0, count = 0.0;

  void add(double value, double weight) {
    sum += weight * value;
    squares += weight * value * value;
    count += weight;
  }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double variance() const { return squares / count - mean() * mean(); }
};

}  // namespace

void restore_variance(const gesture::GestureModel& model, Performance& performance) {
  constexpr double kStill_rad2 = 1e-8;  // a channel that does not move has no range to restore
  for (std::size_t g = 0; g < model.groups.size(); ++g) {
    const gesture::ChannelGroup& group = model.groups[g];
    for (int c = group.first; c < group.first + group.channels; ++c) {
      Moments states, shown;
      for (const PerformedState& state : performance.states) {
        const auto& leaf = model.trees[state.state][g].leaves[state.leaf[g]];
        states.add(leaf.mean[0][c - group.first], state.frames);
      }
      for (const Pose& pose : performance.angles) shown.add(pose[c], 1.0);
      if (shown.variance() < kStill_rad2 || states.variance() < kStill_rad2) continue;
      const double gain =
          std::clamp(std::sqrt(states.variance() / shown.variance()), 1.0, kMaxVarianceGain);
      const double mean = shown.mean();
      for (Pose& pose : performance.angles) pose[c] = mean + gain * (pose[c] - mean);
    }
  }
}

}  // namespace posed::perform
