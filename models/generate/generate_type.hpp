#pragma once

#include "models/stage_type.hpp"

namespace posed::generate {

// The generate stage's entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& generate_type();

}  // namespace posed::generate
