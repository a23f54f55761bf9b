#include "daemon/tools/command/command.hpp"

#include "daemon/logging/log_output.hpp"

namespace posed::tools {

int report(const Error& error) {
  logging::say("posed: " + error.text());
  return static_cast<int>(error.exit_code);
}

int report(const Result<>& work) {
  return work ? static_cast<int>(ExitCode::kDone) : report(work.error());
}

}  // namespace posed::tools
