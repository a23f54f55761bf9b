#pragma once

#include "models/stage_type.hpp"

namespace posed::style {

// The style stage's entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& style_type();

}  // namespace posed::style
