// What only one user can have: a port to listen on, a glove's port. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/daemon_config.hpp"

namespace posed::config {

struct PortClash {
  std::string_view key{};  // of the table that comes second
  int line = 0;            // of that table, where the key has several; 0: unknown
  std::string message{};
};

// Ports that the config gives away twice, so that one of the two would never work.
[[nodiscard]] std::vector<PortClash> port_clashes(const DaemonConfig& config);

}  // namespace posed::config
