// Reads the tables [record] and [trigger].
#pragma once

#include "daemon/config/config_file.hpp"
#include "daemon/config/daemon_config.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

void read_record(TableReader& root, const ConfigFile& file, DaemonConfig& config);
void read_trigger(TableReader& root, DaemonConfig& config);

}  // namespace posed::config
