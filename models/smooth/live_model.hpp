// LiveModel: a gesture model in the form that the live smoother uses, bound to the skeleton of one
// hand or body (models/smooth/README.md, "Live model"). Each ordered pair (recorded label, label
// before it) has a chain of five states, and each state one Gaussian over all channels, pooled over
// the labels that may follow. A model with one label or more than 8 has one chain per label,
// whatever label comes before. Immutable; shared between threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/pose_channels.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::smooth {

// Frame::label of a motion that has none of the model's labels.
inline constexpr std::string_view kNoneName = "none";
inline constexpr int kMaxLiveChains =
    64;  // also the most labels; pairs are used with up to 8 labels

// [window][channel]; the windows are value [rad], delta [rad/frame] and delta-delta [rad/frame^2],
// with frames at the model's rate. Variances have the squares of these units.
using LiveRows = std::vector<double>;

struct LiveState {
  LiveRows mean, variance;
  double frames = 1.0;  // duration at the model's rate
};

struct LiveChain {
  int label = 0;     // index into LiveModel::labels
  int previous = 0;  // index of the label before it; kAny: any label
};
inline constexpr int kAny = -1;

// gesture::HeldPoses for the channels of the stream. A pose is whitened as W times the pose.
struct LiveHeld {
  std::vector<std::size_t> channel;  // [row] the stream's channel
  std::vector<double> whitening;     // W, row by row as far as the diagonal
  std::vector<double> mean;          // [label][row] W mean
  std::vector<double> limit;         // [label]
  double noise_gain = 0.0;           // what a variance of 1 in each channel adds to a distance
};

struct LiveModel {
  double rate_hz = 30.0;
  std::vector<std::array<char, kMaxLabel>> labels;
  std::vector<LiveChain> chains;
  std::vector<LiveState> states;  // [chain][kStates]
  // The state of motions without a label (models/smooth/README.md, "None"); empty: all get a label.
  std::optional<LiveState> none;
  // The poses by which a hand's model tells such motions; empty: it does so by the Gaussian `none`.
  std::optional<LiveHeld> held;
  // Where a body's channels are in a frame; empty: a hand, whose channels are the skeleton's in the
  // skeleton's order.
  std::optional<gesture::PoseChannels> body;
  int channels = 0;
  int groups = 0;
  std::vector<int> group;           // [channel]
  std::vector<std::uint8_t> moves;  // [channel] 1: it moves in the recordings
};

// Factors on a model's means and variances for a stream of `pace` times the model's rate
// (models/trajectory/README.md, "State information and frame rate"): means scale with the window's
// order; variances also grow by `pace`, so that more frames do not add more information in total.
// RT-safe.
struct RateFactors {
  std::array<double, gesture::kDeltaWindows> mean, variance;
};
[[nodiscard]] constexpr RateFactors rate_factors(double pace) noexcept {
  return {.mean = {1.0, 1.0 / pace, 1.0 / (pace * pace)},
          .variance = {pace, 1.0 / pace, 1.0 / (pace * pace * pace)}};
}

// Returns an error for a skeleton that lacks channels of the model and for a model with more than
// kMaxLiveChains labels. `name` is for errors.
Result<std::unique_ptr<const LiveModel>> bind_live_model(const gesture::GestureModel& model,
                                                         const Skeleton& skeleton,
                                                         const std::string& name);

}  // namespace posed::smooth
