// Reads the [[source]] and [[stream]] tables.
#pragma once

#include "daemon/config/config_file.hpp"
#include "daemon/config/daemon_config.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

// Also max_streams, which limits them, and what only all tables together tell: names that stand for
// two things, bodies that are named twice, sources of which nothing is streamed.
void read_streams(TableReader& root, const ConfigFile& file, DaemonConfig& config);

}  // namespace posed::config
