// What a training finds out about its own clips and its own model: whether there is a style to
// learn, whether it is learnt, and what to do about it if not. Cold.
#pragma once

#include <string>
#include <vector>

#include "models/style/dataset.hpp"
#include "models/style/training_pairs.hpp"

namespace posed::style {

// How the closing was measured.
enum class ClosingBy {
  kLeaveOut,  // on walkers, or halves of clips, that the process had not seen
  kTraining,  // on the clips that it learnt from: nothing could be held out
};

struct TrainingCheck {
  double difference_deg = 0.0;  // of the groups' mean cycles: rms over joints and phases
  double scatter_deg = 0.0;     // of a subject's cycle from its group's; 0: one subject a group
  Way way;
  ClosingBy closing_by = ClosingBy::kTraining;
  std::vector<std::string> problems;  // each says why the model is unusable, and what to do
  std::vector<std::string> warnings;  // what to beware of

  [[nodiscard]] bool usable() const { return problems.empty(); }
  // One sentence: how much of the way the model closes and what a constant offset would, or what
  // makes it unusable.
  [[nodiscard]] std::string verdict(const std::string& target) const;
};

// "closes 86 %", or "leads 8 % away" where the share is below 0.
[[nodiscard]] std::string closing_text(double share);

// Whether a motion of this name has strides: walks and runs of all kinds.
[[nodiscard]] bool is_gait(std::string_view motion);

// Findings on the aligned clips: `way` as training measured it.
[[nodiscard]] TrainingCheck check_training(const Dataset& dataset, const std::string& target,
                                           const Way& way, ClosingBy closing_by);

// Refuses two clips of different groups that are one recording.
[[nodiscard]] Result<> check_recordings(const std::vector<TrainingClip>& clips);

}  // namespace posed::style
