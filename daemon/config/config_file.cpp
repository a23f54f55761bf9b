#include "daemon/config/config_file.hpp"

namespace posed::config {

void ConfigFile::read_parameter(TableReader& table, const ParameterSpec& spec,
                                ParameterValue& value) const {
  table.read(spec, value);
  auto* text = std::get_if<std::string>(&value);
  if (spec.is_path && text != nullptr) *text = resolve(*text).string();
}

}  // namespace posed::config
