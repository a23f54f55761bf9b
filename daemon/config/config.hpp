// Reads the daemon's TOML file into a DaemonConfig. Cold. The file is described, key by key, in
// config/posed.toml; every default is a member's initialiser in daemon/config/daemon_config.hpp
// or, for a driver's own table, in the driver's OptionSpec list.
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
  config::DaemonConfig config;  // to be used only when there are no errors
  std::vector<Error> errors;    // all of them, each one sentence with file and line, exit code 2
  std::set<std::string> known;  // every key that was looked for: "stream.style.alpha"
};

using Drivers = std::span<const drivers::Driver>;

// `path` gives its name to the messages and its folder to relative paths; `drivers` are those that
// streams may name. Reads the key files that the text names, nothing else; whatever the text is, it
// returns.
[[nodiscard]] Reading read_config(const std::string& text, const std::filesystem::path& path,
                                  Drivers drivers);

// The file, all errors (a missing file is one).
[[nodiscard]] Reading read_config_file(const std::filesystem::path& path, Drivers drivers);

// The file, or its first error.
[[nodiscard]] Result<config::DaemonConfig> load_config(const std::filesystem::path& path,
                                                       Drivers drivers);

[[nodiscard]] bool is_stream_name(std::string_view name);  // [a-z0-9_-]{1,32}

}  // namespace posed::config
