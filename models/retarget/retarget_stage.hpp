// The stream's last stage, which puts its pose on another skeleton (models/motion/retarget.hpp).
#pragma once

#include "models/stage_type.hpp"

namespace posed::retarget {

// The entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& retarget_type();

}  // namespace posed::retarget
