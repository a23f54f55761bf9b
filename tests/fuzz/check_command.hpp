// What the pipeline assumes about any command that control lets through.
#pragma once

#include <cstdlib>

#include "daemon/pipeline/messages.hpp"

namespace posed::fuzz {

inline void check_command(const pipeline::Command& command) {
  const pipeline::StageChange& change = command.change;
  if (change.type == nullptr) std::abort();
  if (change.kind == pipeline::StageChange::Kind::kCommand) {
    if (change.index >= change.type->commands.size()) std::abort();
  } else if (change.kind == pipeline::StageChange::Kind::kSet) {
    if (change.index >= change.type->parameters.size()) std::abort();
    const ParameterSpec& spec = change.type->parameters[change.index];
    if (!spec.live || !takes_number(spec, change.value)) std::abort();
  } else if (command.model == nullptr) {
    std::abort();
  }
}

}  // namespace posed::fuzz
