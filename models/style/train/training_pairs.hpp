// The training pairs of a style model: every clip's cycle with the difference to the target at the
// same phase, and the target's own cycles with a difference of zero (models/style/train/README.md,
// "Training pairs"). Cold.
#pragma once

#include <map>
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

// The mean over a group's units (Dataset::unit_of) in one motion, a unit's clips first; equal
// weights. Empty where there is none. With a name, this unit's alone.
[[nodiscard]] Eigen::MatrixXd group_cycle(const Dataset& dataset,
                                          const std::vector<ClipCycle>& cycles,
                                          const std::string& group, const std::string& motion,
                                          const std::string& unit = {});

// What the target adds to one source group in one motion.
struct Difference {
  std::string motion, group;
  Eigen::MatrixXd delta;                         // harmonic coefficients
  std::map<std::string, Eigen::MatrixXd> own{};  // of each unit that walks in both styles
};

// In the clips' order. The mean over the units that have both styles of what sets their own two
// apart; where none has both, what sets the two groups apart.
[[nodiscard]] std::vector<Difference> differences_of(const Dataset& dataset,
                                                     const std::vector<ClipCycle>& cycles,
                                                     const std::string& target);

// The cycle that this clip should reach: its own unit's in the target's style; where the unit has
// none, its own cycle and the difference, or, if nobody shows both styles, the target's mean.
[[nodiscard]] Eigen::MatrixXd goal_of(const Dataset& dataset, const std::vector<ClipCycle>& cycles,
                                      const AlignedClip& clip, const Difference& difference,
                                      const std::string& target);

// The pairs that the process learns from: an input for each clip. The clips at `left_out` show
// nothing, but keep their place among the inputs.
[[nodiscard]] TrainingPairs make_training_pairs(const Dataset& dataset,
                                                const std::vector<ClipCycle>& cycles,
                                                const std::string& target,
                                                const std::vector<int>& left_out = {});

// Folds for the choice of the kernel: a clip left out where its unit still shows its difference,
// and with it a take of the target, which it should reach, where the unit has another; else a
// person where at least two others show one, else one half of each clip against the other half;
// none where clips are too short. A person who is left out is asked for the others' difference,
// because nobody knows how another one acts. They refer to `dataset`.
[[nodiscard]] LeaveOut make_folds(const Dataset& dataset, const std::string& target);

}  // namespace posed::style
