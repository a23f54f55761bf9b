// The readers of the config's tables, and what they share. Private to daemon/config.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/config/daemon_config.hpp"
#include "drivers/driver.hpp"
#include "proto/text/findings.hpp"
#include "proto/text/parameter.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::config {

struct ConfigFile {
  std::filesystem::path folder;  // of relative paths
  Drivers drivers;
  Findings& findings;

  [[nodiscard]] std::filesystem::path resolve(const std::string& path) const {
    return path.empty() ? std::filesystem::path{} : folder / path;
  }

  // A driver's option or a stage's parameter.
  void read_parameter(TableReader& table, const ParameterSpec& spec, ParameterValue& value) const;
};

// Reads the [[source]] and [[stream]] tables and max_streams, and runs the checks that need all
// tables: names that stand for two things, bodies that are named twice, sources of which nothing is
// streamed, streams that need each other.
void read_streams(TableReader& root, const ConfigFile& file, DaemonConfig& config);

// Of a source with streams = "all": the names of its streams begin with it.
inline constexpr std::size_t kMaxPrefixBytes = 20;

// Reads a [[source]] table: a device with several bodies.
void read_source(TableReader& table, const ConfigFile& file, SourceConfig& source);

// What happens to the frames of a stream, from its [[stream]] table or, for all bodies of a source,
// from the [[source]] table: publish_raw, stale_after_s, stages and the tables of the stages.
void read_settings(TableReader& table, const ConfigFile& file, StreamConfig& stream);

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

// Reads the [[output]] tables: other ways out for the frames than ZeroMQ. Call after
// read_streams(), because outputs name streams.
void read_outputs(TableReader& root, const ConfigFile& file, DaemonConfig& config);

// A table with a name, for check_names().
struct NamedTable {
  std::string name;
  int line = 0;
  bool is_source = false;
  bool publish_raw = false;  // of a stream, as <name>-raw
};

// Adds an error for each name that a table before has, and for each that is the name of a stream's
// raw input.
void check_names(std::vector<NamedTable> tables, Findings& findings);

// Adds an error for each partner that cannot exist, is the stream itself, or needs the stream as a
// partner, directly or by other streams. Call when all streams and sources are read.
void check_partners(const DaemonConfig& config, Findings& findings);

}  // namespace posed::config
