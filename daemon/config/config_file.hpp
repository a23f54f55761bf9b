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
  std::filesystem::path folder;  // in which relative paths begin
  Drivers drivers;
  Findings& findings;

  [[nodiscard]] std::filesystem::path resolve(const std::string& path) const {
    return path.empty() ? std::filesystem::path{} : folder / path;
  }

  // Reads a driver's option or a stage's parameter, and resolves it if it names a file.
  void read_parameter(TableReader& table, const ParameterSpec& spec, ParameterValue& value) const;
};

// Reads the [[source]] and [[stream]] tables and max_streams, and runs the checks that need all
// tables: names that stand for two things, bodies that are named twice, sources of which nothing is
// streamed, streams that need each other.
void read_streams(TableReader& root, const ConfigFile& file, DaemonConfig& config);

// Of a source with streams = "all" the most bytes of its name, with which its streams' names begin.
inline constexpr std::size_t kMaxPrefixBytes = 20;

// Reads a [[source]] table: a device with several bodies.
void read_source(TableReader& table, const ConfigFile& file, SourceConfig& source);

// Reads what happens to a stream's frames (publish_raw, stale_after_s, stages and the tables of the
// stages) from its [[stream]] table or, for all bodies of a source, from the [[source]] table.
void read_settings(TableReader& table, const ConfigFile& file, StreamConfig& stream);

// Returns the driver of this name. If there is none, adds an error (an empty name has one already)
// and returns null.
[[nodiscard]] const drivers::Driver* named_driver(TableReader& table, const ConfigFile& file,
                                                  const std::string& name);

// Reads the driver's options from its own table, such as [stream.file]; the others get their
// defaults. For a device that may be unplugged, `port`, `id` and `hand` stand in `table` itself.
void read_options(TableReader& table, const ConfigFile& file, const drivers::Driver& driver,
                  drivers::Options& options);

// Marks all driver tables in `table` as read, so that a table with another mistake does not get an
// error about an unknown key for each of them as well.
void skip_driver_tables(TableReader& table, const ConfigFile& file);

// Adds an error for each key of a device in the [[stream]] table of a body, because such keys stand
// in the [[source]] table. `driver` is that of the source; empty if it is unknown.
void refuse_device_keys(TableReader& table, const ConfigFile& file, const std::string& driver);
// Marks the same keys as read without errors, for a table that has another mistake.
void skip_device_keys(TableReader& table, const ConfigFile& file);

// Reads the [[output]] tables: other ways out for the frames than ZeroMQ. Call after
// read_streams(), because outputs name streams.
void read_outputs(TableReader& root, const ConfigFile& file, DaemonConfig& config);

// A table with a name, for check_names().
struct NamedTable {
  std::string name;
  int line = 0;
  bool is_source = false;
  bool publish_raw = false;  // <name>-raw is published, too
};

// Adds an error for each name that an earlier table has, that a stream's raw input has, or that is
// too long for the stream's own raw input.
void check_names(std::vector<NamedTable> tables, Findings& findings);

// Adds an error for each partner (StageType::partners) that cannot exist, is the stream itself, or
// needs the stream's frames, directly or by its own partners. Call after all streams and sources
// are read.
void check_partners(const DaemonConfig& config, Findings& findings);

}  // namespace posed::config
