// A device's description as a person writes it: one TOML file. README.md goes through an example.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/described/table.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::described {

inline constexpr std::size_t kMaxDeviceFile = 64 * 1024;  // bytes

// A mistake is named with `file`, line and what is allowed there. Cold.
[[nodiscard]] Result<Table> parse_device(const std::string& toml, const std::string& file);

// The text that `device` names: a description built into posed ("vmg30") or, when it ends in
// ".toml", a file. Cold.
[[nodiscard]] Result<std::string> device_text(const std::string& device);

// The names of the descriptions that are built in. Cold.
[[nodiscard]] std::vector<std::string> shipped_devices();

}  // namespace posed::drivers::described
