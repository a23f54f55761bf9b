// The feet stage as the rest of posed knows it.
#pragma once

#include "models/stage_type.hpp"

namespace posed::feet {

[[nodiscard]] const StageType& feet_type();

}  // namespace posed::feet
