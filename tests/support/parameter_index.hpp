// The place of a parameter in its stage's table, which Stage::set() and state() number it by.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string_view>

#include "models/stage_type.hpp"

namespace posed::test {

// Throws std::invalid_argument for a stage without such a parameter.
[[nodiscard]] inline std::uint8_t parameter_index(const StageType& type, std::string_view name) {
  const ParameterSpec* const found = find_parameter(type.parameters, name);
  if (found == nullptr) throw std::invalid_argument("the stage has no such parameter");
  return static_cast<std::uint8_t>(found - type.parameters.data());
}

}  // namespace posed::test
