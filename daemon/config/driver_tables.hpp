// Reads which driver a [[stream]] or [[source]] table names, and the driver's options.
#pragma once

#include <string>

#include "daemon/config/config_file.hpp"
#include "drivers/driver.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

// The driver of this name. If there is none, adds an error and returns null.
[[nodiscard]] const drivers::Driver* named_driver(TableReader& table, const ConfigFile& file,
                                                  const std::string& name);

// Completes the options: those of the driver's own table, and for a device that is selected by its
// port or id those that stand beside the driver's name.
void read_options(TableReader& table, const ConfigFile& file, const drivers::Driver& driver,
                  drivers::Options& options);

// For a table that has another mistake: its driver tables are not reported as unknown as well.
void skip_driver_tables(TableReader& table, const ConfigFile& file);

// For a stream of a source: what belongs to a device stands in the [[source]] table. `driver` is
// that of the source; empty if it is unknown.
void refuse_device_keys(TableReader& table, const ConfigFile& file, const std::string& driver);
// The same without errors, for a table that has another mistake.
void skip_device_keys(TableReader& table, const ConfigFile& file);

}  // namespace posed::config
