#include "daemon/tools/command/command.hpp"

#include "daemon/logging/log_output.hpp"

namespace posed::tools {

int report(const Error& error) {
  logging::say("posed: " + error.text());
  return static_cast<int>(error.exit_code);
}

}  // namespace posed::tools
