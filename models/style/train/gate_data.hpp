// Computes, from the aligned training clips, what a style model stores besides the difference of
// styles: data for the gate, the warm-up and auto-alpha (README.md has a section on each). Cold.
#pragma once

#include <string>
#include <vector>

#include "models/style/model/style_model.hpp"
#include "models/style/train/dataset.hpp"

namespace posed::style {

// `targets`: the groups that are styles; the others are where a stranger starts from. If any clip
// shows no strides, only `neutral` is filled. `rigs` and `places` are left to the caller.
[[nodiscard]] GateData gate_data_of(const Dataset& dataset,
                                    const std::vector<std::string>& targets);
// `target`: one style. Empty if no other group is there or the means of both coincide.
[[nodiscard]] StyleAxis style_axis_of(const Dataset& dataset, const std::string& target);

}  // namespace posed::style
