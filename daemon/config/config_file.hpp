// What the readers of the config's tables share.
#pragma once

#include <filesystem>
#include <string>

#include "daemon/config/config.hpp"
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

}  // namespace posed::config
