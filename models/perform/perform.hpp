// A whole label string performed at once: what `posed synth` writes and `posed eval gesture`
// judges. The same script, evidence and solver as the player's. Cold.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "models/trajectory/state_information.hpp"
#include "proto/frame/result.hpp"

namespace posed::perform {

struct PerformOptions {
  double tempo = 1.0;
  std::optional<int> look_ahead{};  // frames of the script known at each; none: all (full solve)
  bool global_variance = false;     // give back the liveliness that averaging took
};

struct PerformedState {
  gesture::Context context;
  int state = 0;  // 0 to 4
  int start = 0;  // first frame
  int frames = 0;
  std::array<int, kFingers> leaf{};  // of each finger's tree
};

struct Performance {
  double rate_hz = 0.0;
  std::vector<PerformedState> states;
  std::vector<HandAngles> angles;     // [frame], rad
  std::vector<HandAngles> variances;  // of each angle, rad^2
};

// Words between blanks, as label indices. Refuses an empty string and words that are no label of
// the model, naming those that are.
[[nodiscard]] Result<std::vector<int>> labels_of(const gesture::GestureModel& model,
                                                 std::string_view text);

// At the model's rate. `labels` has at least one.
[[nodiscard]] Performance perform(const trajectory::StateInformation& evidence,
                                  std::span<const int> labels, const PerformOptions& options);

}  // namespace posed::perform
