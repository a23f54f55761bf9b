// The merge stage as the rest of posed knows it.
#pragma once

#include "models/stage_type.hpp"

namespace posed::merge {

[[nodiscard]] const StageType& merge_type();

}  // namespace posed::merge
