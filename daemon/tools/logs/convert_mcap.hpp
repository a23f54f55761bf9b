// The part of `posed convert` that writes a whole log as MCAP.
#pragma once

#include <string>

namespace posed::tools {

// Returns the exit code. Ctrl-C leaves no file.
[[nodiscard]] int convert_to_mcap(const std::string& log, const std::string& out, bool json);

}  // namespace posed::tools
