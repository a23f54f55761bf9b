#include "daemon/config/config_file.hpp"

namespace posed::config {

void ConfigFile::read_parameter(TableReader& table, const ParameterSpec& spec,
                                ParameterValue& value) const {
  table.read(spec, value);
  auto* text = std::get_if<std::string>(&value);
  // A default is a word that stands for no file, if it is not empty.
  const bool names_file = spec.is_path && text != nullptr && value != spec.default_value &&
                          text->ends_with(spec.path_ending);
  if (names_file) *text = resolve(*text).string();
}

}  // namespace posed::config
