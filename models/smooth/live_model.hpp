// LiveModel: a gesture model as the live generator uses it, bound to the skeleton of one hand. A
// chain of five states per recorded label and label before it, one Gaussian over all channels a
// state: the mean and spread over what may come next. Models with many labels have a chain a label,
// whatever comes before. Immutable; shared between threads.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::smooth {

inline constexpr int kMaxLiveChains = 64;  // as many labels at most; pairs of up to 8

// One row a window (value, delta, delta-delta), the hand skeleton's channels in their order;
// radians per frame of the model's rate to the power of the window's order.
using HandRows = std::array<std::array<double, kHandChannels>, gesture::kDeltaWindows>;

struct LiveState {
  HandRows mean{}, variance{};
  double frames = 1.0;  // that it lasts, at the model's rate
};

struct LiveChain {
  int label = 0;     // index into LiveModel::labels
  int previous = 0;  // the same; kAny whatever came before
};
inline constexpr int kAny = -1;

struct LiveModel {
  double rate_hz = 30.0;
  std::vector<std::array<char, kMaxLabel>> labels;
  std::vector<LiveChain> chains;
  std::vector<LiveState> states;            // [chain][kStates]
  std::array<bool, kHandChannels> moves{};  // the channel moved in the recordings
  std::uint32_t skeleton = 0;               // id of the skeleton it is bound to
};

// What a model's features become at a rate ratio of its own rate (models/trajectory/README.md,
// "State information and frame rate"): means by the window's order; variances so that more frames
// do not vote harder. RT-safe.
struct RateRule {
  std::array<double, gesture::kDeltaWindows> mean, variance;
};
[[nodiscard]] constexpr RateRule rate_rule(double pace) noexcept {
  return {.mean = {1.0, 1.0 / pace, 1.0 / (pace * pace)},
          .variance = {pace, 1.0 / pace, 1.0 / (pace * pace * pace)}};
}

// Refuses a skeleton that is not a hand's and a model with more labels than are served. `name` is
// for errors.
[[nodiscard]] Result<std::unique_ptr<const LiveModel>> bind_live_model(
    const gesture::GestureModel& model, const Skeleton& skeleton, const std::string& name);

}  // namespace posed::smooth
