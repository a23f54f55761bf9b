// What a model stores about its training's walkers beside the difference of styles: for the gate,
// the warm-up and auto-alpha (README.md has a section on each). Cold.
#pragma once

#include <string>
#include <vector>

#include "models/style/model/style_model.hpp"
#include "models/style/train/dataset.hpp"

namespace posed::style {

[[nodiscard]] GateData gate_data_of(const Dataset& dataset,
                                    const std::vector<std::string>& targets);
[[nodiscard]] StyleAxis style_axis_of(const Dataset& dataset, const std::string& target);

}  // namespace posed::style
