// Reads the [[output]] tables: other ways out for the frames than ZeroMQ.
#pragma once

#include "daemon/config/config_file.hpp"
#include "daemon/config/daemon_config.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

// After the streams, which the outputs name.
void read_outputs(TableReader& root, const ConfigFile& file, DaemonConfig& config);

}  // namespace posed::config
