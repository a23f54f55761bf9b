// The part of `posed convert` that lists the takes of a log.
#pragma once

#include <string>

namespace posed::tools {

// Prints those of the log at `path`, a line each, or as JSON. Returns the exit code.
[[nodiscard]] int list_takes(const std::string& path, bool json);

}  // namespace posed::tools
