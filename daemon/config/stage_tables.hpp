// Reads what happens to the frames of a stream: from its [[stream]] table or, for all bodies of a
// source, from the [[source]] table.
#pragma once

#include "daemon/config/config_file.hpp"
#include "daemon/config/daemon_config.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

// publish_raw, stale_after_s, stages and the tables of the stages.
void read_settings(TableReader& table, const ConfigFile& file, StreamConfig& stream);

}  // namespace posed::config
