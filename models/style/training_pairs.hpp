// The training pairs of a style model: every source subject's cycle with the difference to the
// target at the same phase, and the target's own cycles with a difference of zero (README.md,
// "Training pairs"). Cold.
#pragma once

#include <string>
#include <vector>

#include "models/style/dataset.hpp"
#include "models/style/difference.hpp"

namespace posed::style {

// One subject's average cycle as harmonic coefficients.
struct SubjectCycle {
  int subject = 0;  // index into Dataset::subjects
  Eigen::MatrixXd coefficients;
};

// Cycles of all subjects by harmonic regression at the clips' phases; a subject's clips have equal
// weight.
[[nodiscard]] std::vector<SubjectCycle> subject_cycles(const Dataset& dataset);

// The mean over a group's subjects in one motion, with equal weights; empty when there is none.
[[nodiscard]] Eigen::MatrixXd group_cycle(const Dataset& dataset,
                                          const std::vector<SubjectCycle>& cycles,
                                          const std::string& group, const std::string& motion);

// The pairs that the process learns from. A motion without the target or without a source gives
// none; `first_source` is the group whose mean difference is the prior mean.
[[nodiscard]] std::vector<Pairing> make_training_pairs(const Dataset& dataset,
                                                       const std::vector<SubjectCycle>& cycles,
                                                       const std::string& target,
                                                       const std::string& first_source);

// Folds for the choice of the length: one source subject left out where a group has several in a
// motion, else one half of each source clip against the other half; none where clips are too short.
[[nodiscard]] std::vector<Fold> make_folds(const Dataset& dataset, const std::string& target,
                                           const std::string& first_source);

}  // namespace posed::style
