// A device description written by a person: one TOML file. drivers/described/README.md explains an
// example.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/described/table.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::described {

inline constexpr std::size_t kMaxDeviceFile = 64 * 1024;  // bytes
// What the path of a description ends in; any other name is that of one built into posed.
inline constexpr std::string_view kDeviceEnding = ".toml";

// An error names `file`, the line and the allowed values. Cold.
Result<Table> parse_device(const std::string& toml, const std::string& file);

// Returns the text of the description that `device` names: one built into posed ("vmg30") or a
// file. Cold.
Result<std::string> device_text(const std::string& device);

// The names of the built-in descriptions. Cold.
[[nodiscard]] std::vector<std::string> shipped_devices();

}  // namespace posed::drivers::described
