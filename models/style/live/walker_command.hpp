// What a warm-up has found as a command of the style stage, and as the device log keeps it: so a
// walker that is known from a clip (parameter `neutral`) replays like one that was warmed up live.
#pragma once

#include <optional>

#include "models/stage.hpp"
#include "models/style/live/warm_up.hpp"

namespace posed::v1 {
class DecisionValue;
}  // namespace posed::v1

namespace posed::style {

// Rounds angles to 1e-4 rad, because a command is small. Angles are those of q, within +-pi. Cold.
[[nodiscard]] StageCommand command_of(const Walker& walker) noexcept;
// RT-safe.
[[nodiscard]] Walker walker_of(const StageCommand& command) noexcept;

void walker_to_log(const StageCommand& command, v1::DecisionValue& value);
// Empty for a value that walker_to_log() cannot have written.
[[nodiscard]] std::optional<StageCommand> walker_from_log(const v1::DecisionValue& value);

}  // namespace posed::style
