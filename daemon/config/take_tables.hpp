// Reads the tables [record] and [trigger].
#pragma once

#include "daemon/config/config_file.hpp"
#include "daemon/config/daemon_config.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

void read_record(TableReader& root, const ConfigFile& file, DaemonConfig& config);
void read_trigger(TableReader& root, DaemonConfig& config);

// Fails where a folder or file of recordings cannot be made: a file is in the way, the file system
// takes none, or the permission is missing. Makes a folder there for a moment.
Result<> check_folder(const RecordConfig& record);

}  // namespace posed::config
