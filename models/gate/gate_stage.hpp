// The stage `gate`: the first of a stream. A value that contradicts the motion around it, such as
// that of a flaky connector or of a marker that was taken for another, is dropped: it is missing in
// the frame that leaves, as if it had not been measured, and later stages bridge it. No delay and
// nothing is held: what persists is true (models/gate/README.md).
#pragma once

#include "models/stage_type.hpp"

namespace posed::gate {

// The entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& gate_type();

}  // namespace posed::gate
