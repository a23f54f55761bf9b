// The retarget stage as the rest of posed knows it.
#pragma once

#include "models/stage_type.hpp"

namespace posed::retarget {

[[nodiscard]] const StageType& retarget_type();

}  // namespace posed::retarget
