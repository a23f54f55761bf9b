// Reads a [[source]] table: a device with several bodies.
#pragma once

#include <cstddef>

#include "daemon/config/config_file.hpp"
#include "daemon/config/daemon_config.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

// Of a source with streams = "all": the names of its streams begin with it.
inline constexpr std::size_t kMaxPrefixBytes = 20;

void read_source(TableReader& table, const ConfigFile& file, SourceConfig& source);

}  // namespace posed::config
