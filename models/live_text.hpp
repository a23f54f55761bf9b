// Live parameters that are text of no fixed words, such as the weights of styles: what they mean
// may depend on the stage's model, and the stage gets it in a form of its own. So the stage's type
// has a command of the same name, whose only word is the text; control, device log and replay
// handle the parameter as that command. Cold.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "models/stage_type.hpp"

namespace posed {

// The command that sets this live text (index in StageType::commands); nothing for a parameter that
// is not one.
[[nodiscard]] inline std::optional<std::size_t> text_command(const StageType& type,
                                                             const ParameterSpec& spec) noexcept {
  if (!spec.live || has_number(spec)) return std::nullopt;
  const auto found = std::ranges::find(type.commands, spec.name, &StageCommandType::name);
  if (found == type.commands.end()) return std::nullopt;
  return static_cast<std::size_t>(found - type.commands.begin());
}

// Whether this command is the one of a live text.
[[nodiscard]] inline bool is_live_text(const StageType& type, std::string_view command) noexcept {
  const ParameterSpec* const spec = find_parameter(type.parameters, command);
  return spec != nullptr && text_command(type, *spec).has_value();
}

}  // namespace posed
