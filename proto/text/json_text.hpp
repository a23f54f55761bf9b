// Converts JSON values to text. Strings that are not valid UTF-8 (a file's name, a label, a
// device's own name) get U+FFFD in place of the invalid bytes, because nlohmann's dump() would
// throw.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace posed {

// On one line, or indented by `indent` spaces per level.
[[nodiscard]] std::string json_text(const nlohmann::json& value, int indent = -1);
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& value, int indent = -1);

}  // namespace posed
