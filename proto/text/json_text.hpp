// JSON values as text. Strings in them that are not UTF-8 (a file's name, a label, what a device
// calls itself) are written with U+FFFD in place of the broken bytes: nlohmann's dump() throws.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace posed {

// On one line, or indented by `indent` spaces a level.
[[nodiscard]] std::string json_text(const nlohmann::json& value, int indent = -1);
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& value, int indent = -1);

}  // namespace posed
