// FeetStage: makes the feet of a styled body stand where the performer's do
// (models/feet/README.md). It needs the frame before the style beside the styled one, holds nothing
// back and looks at no later frame.
#pragma once

#include <memory>

#include "models/feet/root_motion.hpp"
#include "models/stage_type.hpp"

namespace posed::feet {

// The entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& feet_type();

// The stage for an offline command. `rate_hz`: nominal, for frames without times; 0: unknown.
// Returns an error for a skeleton whose legs cannot be found.
Result<std::unique_ptr<Stage>> make_feet_stage(std::shared_ptr<const Skeleton> skeleton,
                                               double rate_hz, const RootOptions& root);

}  // namespace posed::feet
