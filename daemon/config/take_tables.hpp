// Reads the tables [record] and [trigger].
#pragma once

#include "daemon/config/config_file.hpp"
#include "daemon/config/daemon_config.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

void read_record(TableReader& root, const ConfigFile& file, DaemonConfig& config);
void read_trigger(TableReader& root, DaemonConfig& config);

// Fails where the folder of recordings can never be made, because a file is in its way.
[[nodiscard]] Result<> check_folder(const RecordConfig& record);

}  // namespace posed::config
