// The training pairs of a style model: every clip's cycle with the difference to the target at the
// same phase, and the target's own cycles with a difference of zero (README.md, "Training pairs").
// Cold.
#pragma once

#include <string>
#include <vector>

#include "models/style/train/dataset.hpp"
#include "models/style/train/kernel_choice.hpp"

namespace posed::style {

// The average cycle of one clip as harmonic coefficients.
struct ClipCycle {
  int clip = 0;  // index into Dataset::clips
  Eigen::MatrixXd coefficients;
};

// Cycles of all clips by harmonic regression at their phases.
[[nodiscard]] std::vector<ClipCycle> clip_cycles(const Dataset& dataset);

// The mean over a group's people in one motion, a person's clips first; equal weights. Empty where
// there is none. With a name, this person's alone.
[[nodiscard]] Eigen::MatrixXd group_cycle(const Dataset& dataset,
                                          const std::vector<ClipCycle>& cycles,
                                          const std::string& group, const std::string& motion,
                                          const std::string& person = {});

// What the target adds to one source group in one motion.
struct Difference {
  std::string motion, group;
  Eigen::MatrixXd delta;  // harmonic coefficients
  int people = 0;         // who walk in both styles; 0: the difference of the groups' means
};

// In the clips' order. The mean over the people who have both styles of what sets their own two
// apart; where nobody has both, what sets the two groups apart.
[[nodiscard]] std::vector<Difference> differences_of(const Dataset& dataset,
                                                     const std::vector<ClipCycle>& cycles,
                                                     const std::string& target);

// The cycle that this clip should reach: its own person's in the target's style; where the person
// has none, its own cycle and the difference, or, if nobody shows both styles, the target's mean.
[[nodiscard]] Eigen::MatrixXd goal_of(const Dataset& dataset, const std::vector<ClipCycle>& cycles,
                                      const AlignedClip& clip, const Difference& difference,
                                      const std::string& target);

// The pairs that the process learns from: an input for each clip. The clips at `left_out` show
// nothing, but keep their place among the inputs.
[[nodiscard]] TrainingPairs make_training_pairs(const Dataset& dataset,
                                                const std::vector<ClipCycle>& cycles,
                                                const std::string& target,
                                                const std::vector<int>& left_out = {});

// Folds for the choice of the kernel: a person left out where others show the difference, else a
// clip where its person has several, else one half of each source clip against the other half; none
// where clips are too short. They refer to `dataset`.
[[nodiscard]] LeaveOut make_folds(const Dataset& dataset, const std::string& target);

}  // namespace posed::style
