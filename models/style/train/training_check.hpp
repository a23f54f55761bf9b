// Checks of a training's clips and model: whether there is a style to learn, whether it is learnt,
// and what to do if not (models/style/train/README.md, "Verdicts"). Cold.
#pragma once

#include <string>
#include <vector>

#include "models/style/train/dataset.hpp"
#include "models/style/train/training_pairs.hpp"

namespace posed::style {

// Stride scores (stride_phase.hpp) above which a clip is warned of, and is no walk
// (models/style/train/README.md, "Verdicts").
inline constexpr double kUnevenStrides = 0.2;
inline constexpr double kNoStrides = 0.5;

// On which data the closed share of the distance was measured.
enum class ClosingBy {
  kLeaveOut,  // on walkers, or halves of clips, that were held out
  kTraining,  // on the training clips, because nothing could be held out
};

struct TrainingCheck {
  double difference_deg = 0.0;  // of the groups' mean cycles: rms over joints and phases
  double scatter_deg = 0.0;     // of a clip's cycle from its person's in its group; 0 with one each
  Way way;
  ClosingBy closing_by = ClosingBy::kTraining;
  std::vector<std::string> problems;  // each says why the model is unusable, and what to do
  std::vector<std::string> warnings;  // each states a risk

  [[nodiscard]] bool usable() const { return problems.empty(); }
  // One sentence: how much of the distance the model closes and how much a constant offset would,
  // or why the model is unusable.
  [[nodiscard]] std::string verdict(const std::string& target) const;
};

// "86 %", or "8 % in the wrong direction" where the share is below 0.
[[nodiscard]] std::string closing_text(double share);

// Whether a motion of this name is expected to have strides: walks and runs of all kinds.
[[nodiscard]] bool is_gait(std::string_view motion);

// Why the clip's legs show no strides; empty where they do.
[[nodiscard]] std::string no_strides(const AlignedClip& clip);

// Whether the clip's legs stride: they swing far enough, in a rhythm.
[[nodiscard]] bool shows_strides(const AlignedClip& clip);

// How far the clip's frames are from its own cycle at their phases: rms over frames and joints.
[[nodiscard]] double cycle_residual_deg(const Dataset& dataset, const AlignedClip& clip);

// Checks the aligned clips; `way` is what training measured.
[[nodiscard]] TrainingCheck check_training(const Dataset& dataset, const std::string& target,
                                           const Way& way, ClosingBy closing_by);

[[nodiscard]] bool is_same_recording(const clip::Clip& a, const clip::Clip& b);

// Returns an error when two clips of different groups are the same recording.
Result<> check_recordings(const std::vector<TrainingClip>& clips);

}  // namespace posed::style
