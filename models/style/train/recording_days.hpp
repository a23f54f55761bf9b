// Takes of several days: a person's own walk tells the day, and the style differs between days.
// Where held-out takes confirm that takes in the same place of the two lists belong together, each
// take learns the style of the takes like it (README.md, "Days"). Cold.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "models/style/train/training_pairs.hpp"

namespace posed::style {

// For source takes (indices into `takes`) of people whose days are followed: what to add to the
// person's mean difference. Takes at `left_out` show nothing. Empty where no days are followed.
[[nodiscard]] std::vector<std::pair<int, Eigen::MatrixXd>> day_changes(
    const Dataset& dataset, const std::vector<TakeCycle>& takes, const std::vector<int>& left_out,
    const std::string& target);

}  // namespace posed::style
