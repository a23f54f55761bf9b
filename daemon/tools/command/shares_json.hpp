// How much of each style of a model is mixed, for reports. Cold.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/style/live/style_weights.hpp"

namespace posed::tools {

// {"feminine": 0.6, "elderly": 0.4}
[[nodiscard]] inline nlohmann::json shares_json(const std::vector<std::string>& names,
                                                const style::Shares& shares) {
  nlohmann::json json = nlohmann::json::object();
  for (std::size_t s = 0; s < names.size(); ++s) json[names[s]] = shares.of[s];
  return json;
}

}  // namespace posed::tools
