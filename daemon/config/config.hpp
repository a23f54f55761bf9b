// Reads the daemon's TOML file into a DaemonConfig. Cold. config/posed.toml documents the file key
// by key. Every default is a member's initialiser in daemon/config/daemon_config.hpp or, for a
// driver's own table, in the driver's OptionSpec list.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/net/security.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/result.hpp"

namespace posed::config {

struct Reading {
  config::DaemonConfig config;  // valid only if there are no errors
  std::vector<Error> errors;    // all of them, each one sentence with file and line, exit code 2
  std::set<std::string> known;  // every key that was looked up: "stream.style.alpha"
};

using Drivers = std::span<const drivers::Driver>;

// `path` is used in messages, and its folder for relative paths; `drivers` are those that streams
// may use. Reads the key files that the text names, and no other file. Any text gives a Reading.
[[nodiscard]] Reading read_config(const std::string& text, const std::filesystem::path& path,
                                  Drivers drivers);

// Reads the file; returns all errors (a missing file is one).
[[nodiscard]] Reading read_config_file(const std::filesystem::path& path, Drivers drivers);

// Reads the file; returns the first error, if any.
Result<config::DaemonConfig> load_config(const std::filesystem::path& path, Drivers drivers);

// Reads a file with the table [security] alone, for a command that serves without a config; it
// must name a server key. Returns the first error, if any.
Result<SecurityConfig> load_security(const std::filesystem::path& path);

[[nodiscard]] bool is_stream_name(std::string_view name);  // [a-z0-9_-]{1,32}

struct PortClash {
  std::string_view key{};  // of the table that comes second
  int line = 0;            // of that table, where the key has several; 0: unknown
  std::string message{};
};

// Returns the ports that the config assigns twice, so that one of the two would never work.
[[nodiscard]] std::vector<PortClash> port_clashes(const DaemonConfig& config);

}  // namespace posed::config
