#include "models/smooth/live_model.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <utility>

#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::smooth {
namespace {

using gesture::Context;
using gesture::GestureModel;
using gesture::kDeltaWindows;
using gesture::kStates;

constexpr double kNone_s = 1.0;  // how long none of the labels lasts
constexpr double kNoneSpread = 2.0;
// Deviation of position, delta and delta-delta of a motion that is none, beside the spread of the
// states [rad per frame of the model's rate to the power of the order].
constexpr std::array<double, kDeltaWindows> kNoneWidest_rad{30.0 * kDegree, 5.0 * kDegree,
                                                            2.5 * kDegree};
constexpr double kStill_rad = 1e-6;  // a channel with a smaller range does not move

// All contexts of a label with the given neighbours.
std::vector<Context> contexts_of(int label, std::span<const int> previous,
                                 std::span<const int> trained) {
  const auto beside = [label](std::span<const int> all) {
    std::vector<int> others;
    for (const int other : all) {
      if (other != label) others.push_back(other);
    }
    if (others.empty()) others.push_back(label);
    return others;
  };
  std::vector<Context> contexts;
  for (const int before : beside(previous)) {
    for (const int after : beside(trained)) contexts.push_back({before, label, after});
  }
  return contexts;
}

std::vector<int> trained_labels(const GestureModel& model) {
  std::vector<int> trained;
  for (int i = 0; i < std::ssize(model.labels); ++i) {
    if (model.labels[i].trained) trained.push_back(i);
  }
  return trained;
}

// One chain for each ordered pair of labels, where that is not too many; else one for each label.
std::vector<LiveChain> chains_of(int labels) {
  std::vector<LiveChain> chains;
  const bool pairs = labels * (labels - 1) <= kMaxLiveChains && labels > 1;
  for (int label = 0; label < labels; ++label) {
    if (!pairs) chains.push_back({label, kAny});
    for (int previous = 0; pairs && previous < labels; ++previous) {
      if (previous != label) chains.push_back({label, previous});
    }
  }
  return chains;
}

// The model's channel that a channel of the stream is: hands have theirs in the skeleton's order.
std::size_t model_channel(const GestureModel& model, std::size_t channel) {
  return model.is_hand() ? kAngleOfChannel[channel] : channel;
}

int group_of(const GestureModel& model, std::size_t channel) {
  int group = 0;
  while (static_cast<int>(channel) >= model.groups[group].first + model.groups[group].channels) {
    ++group;
  }
  return group;
}

// Moment matching over the contexts: the mean of their means, and the mean of their variances plus
// the spread of their means (models/smooth/README.md, "Live model").
LiveState state_of(const GestureModel& model, const std::vector<Context>& contexts, int state) {
  const std::size_t channels = model.channels();
  LiveState pooled{.mean = LiveRows(kDeltaWindows * channels),
                   .variance = LiveRows(kDeltaWindows * channels)};
  const double share = 1.0 / static_cast<double>(contexts.size());
  LiveRows square(kDeltaWindows * channels);
  double frames = 0.0;
  for (const Context& context : contexts) {
    frames += share * gesture::duration(model, context).mean[state];
    for (std::size_t c = 0; c < channels; ++c) {
      const std::size_t angle = model_channel(model, c);
      const int group = group_of(model, angle);
      const auto& leaf = gesture::leaf(model, state, group, context);
      const std::size_t at = angle - static_cast<std::size_t>(model.groups[group].first);
      for (std::size_t w = 0; w < kDeltaWindows; ++w) {
        const double mean = leaf.mean[w][at];
        pooled.mean[w * channels + c] += share * mean;
        square[w * channels + c] += share * (leaf.variance[w][at] + mean * mean);
      }
    }
  }
  for (std::size_t k = 0; k < square.size(); ++k) {
    const double mean = pooled.mean[k];
    pooled.variance[k] = std::max(square[k] - mean * mean, 1e-12);
  }
  pooled.frames = std::max(frames, 1.0);
  return pooled;
}

// A Gaussian around all of the model's states that is so wide that only what is far from each of
// them is more probable there (models/smooth/README.md, "None").
LiveState none_of(const LiveModel& model) {
  const std::size_t channels = model.channels;
  LiveState none{.mean = LiveRows(kDeltaWindows * channels),
                 .variance = LiveRows(kDeltaWindows * channels),
                 .frames = kNone_s * model.rate_hz};
  const double share = 1.0 / static_cast<double>(model.states.size());
  for (std::size_t k = 0; k < none.mean.size(); ++k) {
    double square = 0.0;
    for (const LiveState& state : model.states) {
      none.mean[k] += share * state.mean[k];
      square += share * (state.variance[k] + state.mean[k] * state.mean[k]);
    }
    const double widest = kNoneWidest_rad[k / channels];
    none.variance[k] = kNoneSpread * (square - none.mean[k] * none.mean[k]) + widest * widest;
  }
  return none;
}

LiveHeld held_of(const GestureModel& model) {
  const gesture::HeldPoses& from = *model.held;
  const std::size_t channels = model.channels();
  LiveHeld held{.channel = std::vector<std::size_t>(channels),
                .whitening = from.whitening,
                .mean = {},
                .limit = from.limit};
  for (std::size_t c = 0; c < channels; ++c) held.channel[model_channel(model, c)] = c;
  for (const auto& mean : from.mean) {
    for (std::size_t row = 0, at = 0; row < channels; at += ++row) {
      held.mean.push_back(std::inner_product(mean.begin(), mean.begin() + row + 1,
                                             from.whitening.begin() + at, 0.0));
    }
  }
  for (const double value : from.whitening) held.noise_gain += value * value;
  return held;
}

}  // namespace

Result<std::unique_ptr<const LiveModel>> bind_live_model(const GestureModel& model,
                                                         const Skeleton& skeleton,
                                                         const std::string& name) {
  auto channels = gesture::PoseChannels::bind(model, skeleton);
  if (!channels) {
    Error error = channels.error();
    error.file = name;
    return std::unexpected(std::move(error));
  }
  auto live = std::make_unique<LiveModel>();
  live->rate_hz = model.rate_hz;
  live->channels = model.channels();
  live->groups = static_cast<int>(model.groups.size());
  for (std::size_t c = 0; c < static_cast<std::size_t>(live->channels); ++c) {
    const std::size_t angle = model_channel(model, c);
    live->group.push_back(group_of(model, angle));
    live->moves.push_back(model.high[angle] - model.low[angle] > kStill_rad ? 1 : 0);
  }
  if (!model.is_hand()) live->body = std::move(*channels);
  const std::vector<int> trained = trained_labels(model);
  if (trained.empty()) return fail("the model holds no recorded label", name);
  if (std::ssize(trained) > kMaxLiveChains) {
    return fail("the model has " + std::to_string(trained.size()) +
                    " recorded labels; a live stream tells at most " +
                    std::to_string(kMaxLiveChains) + " apart",
                name);
  }
  for (const int label : trained) {
    const std::string& from = model.labels[label].name;
    auto& to = live->labels.emplace_back();
    std::copy_n(from.begin(), std::min(from.size(), to.size() - 1), to.begin());
  }
  live->chains = chains_of(static_cast<int>(trained.size()));
  for (const LiveChain& chain : live->chains) {
    const int label = trained[chain.label];
    const std::span<const int> all(trained);
    const auto previous = chain.previous == kAny ? all : all.subspan(chain.previous, 1);
    const auto contexts = contexts_of(label, previous, trained);
    for (int state = 0; state < kStates; ++state) {
      live->states.push_back(state_of(model, contexts, state));
    }
  }
  const bool tells_none = live->body || model.tells_none;
  if (tells_none && model.label_index(kNoneName) < 0) live->none = none_of(*live);
  if (model.held && (live->none || !tells_none)) live->held = held_of(model);
  return live;
}

}  // namespace posed::smooth
