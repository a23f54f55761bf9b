// Performs a whole label sequence at once (models/perform/README.md, "Whole performance"); used by
// `posed synth` and `posed eval gesture`. It uses the same label sequence, state information and
// solver as the player. Cold.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "models/gesture/recording.hpp"
#include "models/trajectory/state_information.hpp"
#include "proto/frame/result.hpp"

namespace posed::perform {

struct PerformOptions {
  double tempo = 1.0;
  std::optional<int>
      look_ahead{};  // frames of the sequence known ahead of each frame; empty: all (full solve)
  bool global_variance = false;  // restore the range of motion that averaging reduces
};

struct PerformedState {
  gesture::Context context;
  int state = 0;  // 0 to 4
  int start = 0;  // first frame
  int frames = 0;
  std::vector<int> leaf{};  // [group] leaf index of the group's tree
};

using Pose = std::vector<double>;  // [channel of the model]

struct Performance {
  double rate_hz = 0.0;
  std::vector<PerformedState> states;
  std::vector<Pose> angles;     // [frame], rad
  std::vector<Pose> variances;  // of each angle, rad^2
};

// Converts a pose of a model of hands, or its variances.
[[nodiscard]] HandAngles hand_of(const Pose& pose);

// Converts words separated by blanks into label indices. Returns an error for an empty text and for
// words that are not labels of the model; the error lists the labels.
Result<std::vector<int>> labels_of(const gesture::GestureModel& model, std::string_view text);

// The most frames times channels of a performance, which takes about 100 bytes for each: more than
// an hour of a hand, a quarter of an hour of a body at 120 Hz.
inline constexpr std::size_t kMaxPerformedAngles = 8'000'000;

// Performs `labels`, at least one, at the model's rate. Returns an error, before memory is spent,
// if that would take more than kMaxPerformedAngles, and for a model whose numbers give no plausible
// angles.
Result<Performance> perform(const trajectory::StateInformation& information,
                            std::span<const int> labels, const PerformOptions& options);

// A performance as a recording of it would be, with a segment for each label.
[[nodiscard]] gesture::Recording recording_of(const gesture::GestureModel& model,
                                              const Performance& performance);

}  // namespace posed::perform
