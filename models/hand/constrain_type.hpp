#pragma once

#include "models/stage_type.hpp"

namespace posed::hand {

// The constrain stage's entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& constrain_type();

}  // namespace posed::hand
