// What only one user can have: a TCP port to listen on, a glove's port. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/daemon_config.hpp"

namespace posed::config {

struct PortClash {
  std::string_view key;  // the table that comes second
  std::string message;
};

// Ports that the config gives away twice, so that one of the two would never work.
[[nodiscard]] std::vector<PortClash> port_clashes(const DaemonConfig& config);

}  // namespace posed::config
