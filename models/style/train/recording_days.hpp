// Groups a person's clips by the day of recording, inferred from the person's neutral walk, because
// the style differs between days. Where held-out clips confirm that clips in the same place of the
// two lists belong together, each clip learns the style of the clips like it (README.md, "Days").
// Cold.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "models/style/train/training_pairs.hpp"

namespace posed::style {

// For each source clip (an index into `cycles`) of a person whose days are followed: what to add to
// the person's mean difference. Clips at `left_out` are not used. Empty where no days are followed.
[[nodiscard]] std::vector<std::pair<int, Eigen::MatrixXd>> day_changes(
    const Dataset& dataset, const std::vector<ClipCycle>& cycles, const std::vector<int>& left_out,
    const std::string& target);

}  // namespace posed::style
