// The list of all stages, in the order in which a stream runs them unless its config says
// otherwise.
#pragma once

#include <span>
#include <string_view>

#include "models/stage_type.hpp"

namespace posed {

[[nodiscard]] std::span<const StageType* const> stage_types();
[[nodiscard]] const StageType* find_stage_type(std::string_view name);  // null when unknown

}  // namespace posed
