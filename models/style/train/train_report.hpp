// What a training reports: the numbers and sentences of `posed train style --json`, which the model
// keeps. Cold.
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "models/style/train/target_training.hpp"

namespace posed::style {

// The report of one style is part of the whole one, those of several are a list in it.
[[nodiscard]] nlohmann::json whole_report(const Dataset& dataset,
                                          const std::vector<Lesson>& lessons,
                                          const std::vector<Learnt>& learnt);

}  // namespace posed::style
