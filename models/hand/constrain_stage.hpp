// The constraint solver as the pipeline's last stage on a hand: joints keep their limits and
// fingers do not go through each other. Frames of another skeleton pass through.
#pragma once

#include "models/stage_type.hpp"

namespace posed::hand {

// The entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& constrain_type();

}  // namespace posed::hand
